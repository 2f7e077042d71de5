// Points spread over a surface, for what is measured by samples.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "common/mesh/triangle_mesh.h"

namespace fanstream {

struct SpreadPoint {
  glm::dvec3 place{0.0};
  std::uint32_t face = 0;  // that it lies in
};

// One point in each `count`-th part of the area, the faces in their order; within a face by Roberts' quasirandom
// sequence ("The unreasonable effectiveness of quasirandom sequences", 2018), so that there is neither chance nor seed.
// None where there are no triangles; on the first one where no triangle has any area.
std::vector<SpreadPoint> spread_points(const TriangleMesh& mesh, std::size_t count);

}  // namespace fanstream
