// What OpenGL needs to draw a FanMesh: checked, moved to the origin and indexed.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "common/fans/fan_mesh.h"
#include "common/support/result.h"

namespace fanstream {

// The mesh inside the unit ball: drawn = (point - center) / radius. Keeps floats exact enough wherever a model lies.
struct DrawList {
  Bounds bounds;  // of the points in the model's coordinates
  glm::dvec3 center{0.0};
  double radius = 1.0;
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> indices;
  std::vector<std::int32_t> fan_sizes;           // vertices issued for each fan; empty for triangles
  std::vector<std::uintptr_t> fan_offset_bytes;  // of each fan in `indices`
};

// Either the fans, or the same triangles in the same order, each starting at its fan's centre: every triangle then
// meets the rasteriser with the same vertices in the same places, and both pictures are equal to the last bit.
// Fails (bad_input) for a fan or an index outside the mesh and points that are not finite, (limit) for 2^31 indices or
// more.
Result<DrawList> make_draw_list(const FanMesh& mesh, bool as_fans);

}  // namespace fanstream
