// Sums of squared distances from planes as a function of place (Garland and Heckbert 1997), and where it is least.
#pragma once

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <optional>

namespace fanstream {

// The symmetric form x^T A x + 2 b.x + c. Precise for places near the origin it is taken from.
struct Quadric {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0, bx = 0, by = 0, bz = 0, c = 0;

  void add_plane(const glm::dvec3& n, double offset, double weight) {
    xx += weight * n.x * n.x;
    xy += weight * n.x * n.y;
    xz += weight * n.x * n.z;
    yy += weight * n.y * n.y;
    yz += weight * n.y * n.z;
    zz += weight * n.z * n.z;
    bx += weight * n.x * offset;
    by += weight * n.y * offset;
    bz += weight * n.z * offset;
    c += weight * offset * offset;
  }
  void add(const Quadric& q) {
    xx += q.xx, xy += q.xy, xz += q.xz, yy += q.yy, yz += q.yz, zz += q.zz;
    bx += q.bx, by += q.by, bz += q.bz, c += q.c;
  }
  // This one's share of both, the other's the rest.
  void mix(double share, const Quadric& q) {
    const double rest = 1.0 - share;
    xx = share * xx + rest * q.xx, xy = share * xy + rest * q.xy, xz = share * xz + rest * q.xz;
    yy = share * yy + rest * q.yy, yz = share * yz + rest * q.yz, zz = share * zz + rest * q.zz;
    bx = share * bx + rest * q.bx, by = share * by + rest * q.by, bz = share * bz + rest * q.bz;
    c = share * c + rest * q.c;
  }
  double at(const glm::dvec3& p) const {
    return p.x * (xx * p.x + 2 * (xy * p.y + xz * p.z + bx)) + p.y * (yy * p.y + 2 * (yz * p.z + by)) +
           p.z * (zz * p.z + 2 * bz) + c;
  }
  double trace() const { return xx + yy + zz; }  // the sum of the planes' weights
  glm::dvec3 times(const glm::dvec3& v) const {  // A v
    return {xx * v.x + xy * v.y + xz * v.z, xy * v.x + yy * v.y + yz * v.z, xz * v.x + yz * v.y + zz * v.z};
  }
};

// The k at which the form is least on the line a + k u, whether within [0, 1] or not. None where it is constant: u is
// zero, or lies in all planes to rounding.
inline std::optional<double> least_on_line(const Quadric& q, const glm::dvec3& a, const glm::dvec3& u) {
  constexpr double kFlat = 1e-10;
  const glm::dvec3 au = q.times(u);
  const double bend = glm::dot(u, au);
  if (!(bend > kFlat * q.trace() * glm::dot(u, u))) return std::nullopt;
  return -(glm::dot(a, au) + q.bx * u.x + q.by * u.y + q.bz * u.z) / bend;
}

// Where the form is least. Planes that nearly agree leave that open along them, so the form is made a little steeper
// around `near`, by a thousandth of the planes' weight. None where the planes are of one direction, or of two, to
// rounding: where A is singular.
std::optional<glm::dvec3> least_anywhere(const Quadric& q, const glm::dvec3& near);

}  // namespace fanstream
