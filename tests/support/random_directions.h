// Directions at random, uniform over the sphere.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "tests/support/seeded_random.h"

namespace fanstream::testing {

// Of length 1.
inline glm::dvec3 random_direction(SeededRandom& random) {
  for (;;) {
    const glm::dvec3 d(2.0 * random.unit() - 1.0, 2.0 * random.unit() - 1.0, 2.0 * random.unit() - 1.0);
    const double length = glm::length(d);
    if (length > 0.1 && length <= 1.0) return d / length;
  }
}

// On the rim of a cone around an axis of any length, of which this is the cosine of the half angle.
inline glm::dvec3 direction_on_rim(const glm::dvec3& axis, double cosine, SeededRandom& random) {
  const glm::dvec3 along = glm::normalize(axis);
  const glm::dvec3 side = glm::normalize(glm::cross(along, random_direction(random)));
  const double half = std::acos(std::clamp(cosine, -1.0, 1.0));
  return std::cos(half) * along + std::sin(half) * side;
}

}  // namespace fanstream::testing
