// The source's cost of an edge and the place of the vertex that replaces it (see REDUCTION.md).
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace fanstream {

// A = sum of weight * n^T n over planes n = (normal, offset), so that v A v^T, v = (x, y, z, 1), is the weighted sum of
// squared distances of a point to the planes. Symmetric: ten numbers.
struct PlaneQuadric {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;  // the normals' part M
  double bx = 0, by = 0, bz = 0, c = 0;                   // normal * offset, offset^2

  // The plane of the points p with dot(normal, p) + offset = 0; the normal has unit length.
  void add_plane(const glm::dvec3& normal, double offset, double weight) {
    const glm::dvec3 w = weight * normal;
    xx += w.x * normal.x, xy += w.x * normal.y, xz += w.x * normal.z;
    yy += w.y * normal.y, yz += w.y * normal.z, zz += w.z * normal.z;
    bx += w.x * offset, by += w.y * offset, bz += w.z * offset;
    c += weight * offset * offset;
  }
  void add(const PlaneQuadric& q) {
    xx += q.xx, xy += q.xy, xz += q.xz, yy += q.yy, yz += q.yz, zz += q.zz;
    bx += q.bx, by += q.by, bz += q.bz, c += q.c;
  }
  // M p, and the gradient's half M p + b.
  glm::dvec3 turned(const glm::dvec3& p) const {
    return {xx * p.x + xy * p.y + xz * p.z, xy * p.x + yy * p.y + yz * p.z, xz * p.x + yz * p.y + zz * p.z};
  }
  double at(const glm::dvec3& p) const { return glm::dot(p, turned(p)) + 2.0 * (bx * p.x + by * p.y + bz * p.z) + c; }
  double weight() const { return xx + yy + zz; }  // of all planes together
};

struct EdgePlace {
  double k = 0.0;     // along the edge: P = P0 + k u
  double cost = 0.0;  // P A P^T, never negative
};

// Below this share of the planes' weight, u A u^T is rounding: all planes are parallel to the edge.
inline constexpr double kFlatShare = 1e-12;

// The point of the segment p0 p1 with the least cost: k = -(u A P0^T + P0 A u^T) / (2 u A u^T), u = P1 - P0 with a
// homogeneous coordinate of 0, clamped to [0, 1]. Where u A u^T = 0 every point costs the same and k is 1/2. Numbers
// that are not finite give k = 1/2 and an infinite cost.
inline EdgePlace place_on_edge(const PlaneQuadric& a, const glm::dvec3& p0, const glm::dvec3& p1) {
  const glm::dvec3 u = p1 - p0;
  const double curvature = glm::dot(u, a.turned(u));  // u A u^T
  EdgePlace place{0.5, 0.0};
  if (curvature > kFlatShare * a.weight() * glm::dot(u, u)) {
    // A is symmetric, so both terms of the numerator are u . (M p0 + b).
    const glm::dvec3 slope = a.turned(p0) + glm::dvec3(a.bx, a.by, a.bz);
    place.k = std::clamp(-glm::dot(u, slope) / curvature, 0.0, 1.0);
  }
  const double cost = a.at(p0 + place.k * u);
  place.cost = std::isfinite(cost) ? std::max(cost, 0.0) : HUGE_VAL;
  if (!std::isfinite(place.k)) place.k = 0.5;
  return place;
}

// P0 + k u; the ends themselves, to the last bit, for k = 0 and k = 1.
template <class Value>
Value on_edge(const Value& at0, const Value& at1, double k) {
  if (k == 0.0) return at0;
  if (k == 1.0) return at1;
  using Number = typename Value::value_type;
  return at0 + static_cast<Number>(k) * (at1 - at0);
}

}  // namespace fanstream
