// What the readers share for ImportOptions::keep_attributes.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "common/mesh/vertex_attributes.h"

namespace fanstream {

// Texture coordinates of formats whose v runs up from the picture's bottom (OBJ, PLY, OFF); its own inverse.
inline glm::dvec2 v_turned_over(const glm::dvec2& uv) { return {uv.x, 1.0 - uv.y}; }
// Colours of formats that hold what a screen is to be sent: sRGB, opacity left as it is.
glm::vec4 linear_color(const std::array<double, 4>& srgb);

// Adds the attributes of vertices from `first_vertex` on. Vertices before it that have none get the texture coordinates
// 0, 0 and the colour white.
void append_attributes(VertexAttributes& attributes, std::size_t first_vertex, const VertexAttributes& more);

// Gives every vertex of the mesh what some have, and takes out numbers that are none, with a warning.
void finish_attributes(VertexAttributes& attributes, std::size_t vertex_count, std::vector<std::string>& warnings);

// Vertices as pairs of a position and what distinguishes its corners (an index, a texture coordinate): each pair once,
// in the order in which they come up.
template <class Key>
class WedgeTable {
 public:
  static constexpr VertexId kNone = 0xFFFFFFFFU;

  explicit WedgeTable(std::size_t positions) : first_(positions, kNone) {}
  // The number of the pair.
  VertexId add(VertexId position, const Key& key) {
    for (VertexId wedge = first_[position]; wedge != kNone; wedge = next_[wedge]) {
      if (keys_[wedge] == key) return wedge;
    }
    const auto wedge = static_cast<VertexId>(keys_.size());
    keys_.push_back(key);
    positions_.push_back(position);
    next_.push_back(first_[position]);
    first_[position] = wedge;
    return wedge;
  }
  std::size_t size() const { return keys_.size(); }
  VertexId position(std::size_t wedge) const { return positions_[wedge]; }
  const Key& key(std::size_t wedge) const { return keys_[wedge]; }

 private:
  std::vector<VertexId> first_, next_, positions_;
  std::vector<Key> keys_;
};

}  // namespace fanstream
