// What a mesh draws, whatever its indexing: for comparing meshes before and after clean-up or a round trip.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "common/mesh/triangle_mesh.h"

namespace fanstream::testing {

using DrawnTriangle = std::array<std::array<double, 3>, 3>;

// The corner positions of every triangle, corners and triangles sorted, so winding does not count; triangles with two
// corners at one position left out. With `distinct`, each triangle once.
inline std::vector<DrawnTriangle> drawn_triangles(const TriangleMesh& mesh, bool distinct = true) {
  std::vector<DrawnTriangle> drawn;
  for (const Triangle& t : mesh.triangles) {
    DrawnTriangle corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::dvec3 p = mesh.positions[t[k]] + 0.0;  // -0 becomes +0
      corners[k] = {p.x, p.y, p.z};
    }
    std::sort(corners.begin(), corners.end());
    if (corners[0] != corners[1] && corners[1] != corners[2]) drawn.push_back(corners);
  }
  std::sort(drawn.begin(), drawn.end());
  if (distinct) drawn.erase(std::unique(drawn.begin(), drawn.end()), drawn.end());
  return drawn;
}

}  // namespace fanstream::testing
