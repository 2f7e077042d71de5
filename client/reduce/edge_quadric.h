// The source's cost of an edge and the place of the vertex that replaces it (see REDUCTION.md).
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "common/geometry/quadric.h"

namespace fanstream {

struct EdgePlace {
  double k = 0.0;     // along the edge: P = P0 + k u
  double cost = 0.0;  // P A P^T, never negative
};

// Below this share of the planes' weight, u A u^T is rounding: all planes are parallel to the edge.
inline constexpr double kFlatShare = 1e-12;

// The point of the segment p0 p1 with the least cost, A being the quadric of the planes around both ends:
// k = -(u A P0^T + P0 A u^T) / (2 u A u^T), u = P1 - P0 with a homogeneous coordinate of 0, clamped to [0, 1]. Where
// u A u^T = 0 every point costs the same and k is 1/2. Numbers that are not finite give k = 1/2 and an infinite cost.
inline EdgePlace place_on_edge(const Quadric& a, const glm::dvec3& p0, const glm::dvec3& p1) {
  const glm::dvec3 u = p1 - p0;
  const double curvature = glm::dot(u, a.times(u));  // u A u^T
  EdgePlace place{0.5, 0.0};
  if (curvature > kFlatShare * a.trace() * glm::dot(u, u)) {
    // A is symmetric, so both terms of the numerator are u . (M p0 + b).
    const glm::dvec3 slope = a.times(p0) + glm::dvec3(a.bx, a.by, a.bz);
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
