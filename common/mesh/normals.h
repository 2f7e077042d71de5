// Normals at vertices, for shading.
#pragma once

#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "common/mesh/triangle_mesh.h"

namespace fanstream {

struct NormalOptions {
  // A vertex has no one normal where a face around it leans more than this from their mean: on an edge or a corner of a
  // CAD model, or where a level is so coarse that its facets are the shape. 180 makes every vertex smooth.
  double crease_angle_deg = 40.0;
};

// Unit normals, the mean of the face normals weighted by the faces' angles (Thuermer and Wuethrich 1998), which
// does not depend on how the surface around the vertex is cut into triangles. Zero where there is none: at creases, at
// unused vertices, and where the faces are degenerate or cancel out. One normal per position; linear time.
std::vector<glm::vec3> vertex_normals(std::span<const glm::dvec3> positions, std::span<const Triangle> triangles,
                                      const NormalOptions& options = {});

}  // namespace fanstream
