#include "common/geometry/quadric.h"

#include <cmath>

namespace fanstream {

std::optional<glm::dvec3> least_anywhere(const Quadric& q, const glm::dvec3& near) {
  constexpr double kSingular = 1e-9;  // of the determinant, against the trace's cube
  constexpr double kPull = 1e-3;
  const auto determinant = [](double xx, double xy, double xz, double yy, double yz, double zz) {
    return xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
  };
  const double trace = q.trace();
  if (!(determinant(q.xx, q.xy, q.xz, q.yy, q.yz, q.zz) > kSingular * trace * trace * trace)) return std::nullopt;
  // Solved for the way from `near`: (A + pull) d = -(A near + b).
  const double xx = q.xx + kPull * trace;
  const double yy = q.yy + kPull * trace;
  const double zz = q.zz + kPull * trace;
  const glm::dvec3 r = -(q.times(near) + glm::dvec3(q.bx, q.by, q.bz));
  const double det = determinant(xx, q.xy, q.xz, yy, q.yz, zz);
  const glm::dvec3 row_x(yy * zz - q.yz * q.yz, q.xz * q.yz - q.xy * zz, q.xy * q.yz - q.xz * yy);
  const glm::dvec3 row_y(row_x.y, xx * zz - q.xz * q.xz, q.xy * q.xz - xx * q.yz);
  const glm::dvec3 row_z(row_x.z, row_y.z, xx * yy - q.xy * q.xy);
  const glm::dvec3 d = glm::dvec3(glm::dot(row_x, r), glm::dot(row_y, r), glm::dot(row_z, r)) / det;
  if (!std::isfinite(d.x + d.y + d.z)) return std::nullopt;
  return near + d;
}

}  // namespace fanstream
