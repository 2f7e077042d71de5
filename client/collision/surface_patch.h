// A mesh as flat arrays, to be gone through fast.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/mesh/triangle_mesh.h"

namespace fanstream {

struct SurfacePatch {
  std::vector<double> x, y, z;  // by vertex
  std::vector<Triangle> triangles;

  std::size_t vertex_count() const { return x.size(); }
  glm::dvec3 position(std::uint32_t v) const { return {x[v], y[v], z[v]}; }
  std::array<glm::dvec3, 3> corners(std::size_t triangle) const {
    const Triangle& t = triangles[triangle];
    return {position(t[0]), position(t[1]), position(t[2])};
  }
};

// All of a mesh, which is taken for the full model.
SurfacePatch patch_of(const TriangleMesh& mesh);

}  // namespace fanstream
