// What a mesh carries besides positions and triangles: texture coordinates and colours.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec4.hpp>
#include <vector>

#include "common/mesh/triangle_mesh.h"

namespace fanstream {

// Each list is empty or has one entry for everything it belongs to: vertices, or wedges.
struct VertexAttributes {
  // u to the right, v down from the picture's top, as in glTF. In double, so that turning v over and back loses
  // nothing.
  std::vector<glm::dvec2> texture_coordinates;
  std::vector<glm::vec4> colors;  // linear light, red green blue opacity, nominally in [0, 1], as in glTF

  bool empty() const { return texture_coordinates.empty() && colors.empty(); }
};

// Attributes at the corners of a mesh whose positions are shared. A wedge is one set of attributes at one vertex; where
// a vertex has several, a seam runs through it.
struct CornerAttributes {
  VertexAttributes values;       // of the wedges
  std::vector<Triangle> wedges;  // for each triangle's corners; empty where values are

  bool empty() const { return values.empty(); }
};

}  // namespace fanstream
