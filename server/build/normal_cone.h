// Cones of directions in which a piece of surface looks.
#pragma once

#include <glm/vec3.hpp>
#include <optional>
#include <span>

namespace fanstream {

// Holds the unit vectors n with dot(n, axis) >= cosine; a cosine of -1 means all of them.
struct NormalCone {
  glm::vec3 axis{0.0F, 0.0F, 1.0F};
  float cosine = -1.0F;
};

struct WideCone {
  glm::dvec3 axis{0.0, 0.0, 1.0};  // of length 1
  double half_angle = 0.0;         // radians; pi or more: all directions
};

// The cone around the mean of the axes that holds all of them, with what single precision may have rounded them by.
// None where one of them holds all directions, or the axes have no mean.
std::optional<WideCone> cone_around(std::span<const NormalCone> cones);

}  // namespace fanstream
