#include "common/geometry/spread_points.h"

#include <cmath>

namespace fanstream {

std::vector<SpreadPoint> spread_points(const TriangleMesh& mesh, std::size_t count) {
  if (mesh.triangles.empty()) return {};
  std::vector<double> area_before(1, 0.0);
  for (const Triangle& t : mesh.triangles) area_before.push_back(area_before.back() + area_of(mesh, t));
  std::vector<SpreadPoint> points;
  points.reserve(count);
  std::uint32_t face = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double at = (static_cast<double>(i) + 0.5) / static_cast<double>(count) * area_before.back();
    while (face + 1 < mesh.triangles.size() && area_before[face + 1] < at) ++face;
    // Folded into the triangle.
    double u = std::fmod(0.5 + 0.7548776662466927 * static_cast<double>(i), 1.0);
    double v = std::fmod(0.5 + 0.5698402909980532 * static_cast<double>(i), 1.0);
    if (u + v > 1.0) {
      u = 1.0 - u;
      v = 1.0 - v;
    }
    const Triangle& t = mesh.triangles[face];
    const glm::dvec3 a = mesh.positions[t[0]];
    points.push_back({a + u * (mesh.positions[t[1]] - a) + v * (mesh.positions[t[2]] - a), face});
  }
  return points;
}

}  // namespace fanstream
