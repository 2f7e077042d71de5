#include "common/import/attribute_lists.h"

#include <fmt/format.h>

#include <cmath>

#include "common/mesh/srgb.h"

namespace fanstream {
namespace {

constexpr glm::dvec2 kNoTexture{0.0};
constexpr glm::vec4 kWhite{1.0F};

// Bounds that floats and sums of a few keep; beyond them no picture has a place for it.
bool is_sound(double x) { return std::abs(x) <= 1e30; }
bool is_sound(const glm::dvec2& uv) { return is_sound(uv.x) && is_sound(uv.y); }
bool is_sound(const glm::vec4& c) {
  return is_sound(static_cast<double>(c.r)) && is_sound(static_cast<double>(c.g)) &&
         is_sound(static_cast<double>(c.b)) && is_sound(static_cast<double>(c.a));
}

template <class Value>
void append(std::vector<Value>& list, std::size_t first, const std::vector<Value>& more, const Value& missing) {
  if (more.empty()) return;
  list.resize(first, missing);
  list.insert(list.end(), more.begin(), more.end());
}

template <class Value>
std::size_t finish(std::vector<Value>& list, std::size_t count, const Value& missing) {
  if (list.empty()) return 0;
  list.resize(count, missing);
  std::size_t replaced = 0;
  for (Value& value : list) {
    if (is_sound(value)) continue;
    value = missing;
    ++replaced;
  }
  return replaced;
}

}  // namespace

glm::vec4 linear_color(const std::array<double, 4>& srgb) {
  return {linear_of_srgb(static_cast<float>(srgb[0])), linear_of_srgb(static_cast<float>(srgb[1])),
          linear_of_srgb(static_cast<float>(srgb[2])), static_cast<float>(srgb[3])};
}

void append_attributes(VertexAttributes& attributes, std::size_t first_vertex, const VertexAttributes& more) {
  append(attributes.texture_coordinates, first_vertex, more.texture_coordinates, kNoTexture);
  append(attributes.colors, first_vertex, more.colors, kWhite);
}

void finish_attributes(VertexAttributes& attributes, std::size_t vertex_count, std::vector<std::string>& warnings) {
  const std::size_t textures = finish(attributes.texture_coordinates, vertex_count, kNoTexture);
  const std::size_t colors = finish(attributes.colors, vertex_count, kWhite);
  if (textures > 0) {
    warnings.push_back(fmt::format("{} texture coordinates are not finite and were replaced by 0, 0.", textures));
  }
  if (colors > 0) warnings.push_back(fmt::format("{} colours are not finite and were replaced by white.", colors));
}

}  // namespace fanstream
