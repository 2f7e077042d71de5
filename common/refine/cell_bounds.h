// Where a cell's faces lie and which way they look, for culling.
#pragma once

#include <glm/vec3.hpp>

#include "common/refine/cell_coder.h"

namespace fanstream {

// A sphere around all faces that have one of the cell's vertices as a corner, as the mesh is now, and a cone of their
// normals. In the model's coordinates. Safe against rounding: bounds are a little too wide rather than too narrow.
struct CellBounds {
  glm::dvec3 centre{0.0};
  double radius = -1.0;       // negative: the cell has no face
  glm::vec3 cone_axis{0.0F};  // unit length
  float cone_cosine = -1.0F;  // every normal's dot product with the axis is at least this; -1: they look anywhere
};

// The scratch of cell_bounds, to be used again.
struct BoundsScratch {
  std::vector<glm::dvec3> points;
  std::vector<glm::dvec3> normals;  // of any length
};

// Takes time proportional to the cell's faces. Faces without area have no normal and no say in the cone.
CellBounds cell_bounds(const FanState& state, const CellVertices& cell, const PositionGrid& grid,
                       BoundsScratch& scratch);

}  // namespace fanstream
