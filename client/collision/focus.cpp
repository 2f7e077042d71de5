#include "client/collision/focus.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>

#include "common/geometry/closest_point.h"

namespace fanstream {
namespace {

constexpr double kSlack = 1e-12;      // relative to the coordinates; roundings are a ten thousandth of it
constexpr double kAngleSlack = 1e-6;  // radians: cones are in single precision

bool finite(const glm::dvec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

double largest_coordinate(const glm::dvec3& p) { return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}); }

}  // namespace

Result<void> check_focus(const Focus& focus) {
  constexpr double kLargest = 1e70;  // squares of it can be added up
  if (focus.sphere) {
    const FocusSphere& s = *focus.sphere;
    if (!finite(s.centre) || !std::isfinite(s.radius)) return fail(ErrorKind::usage, "the focus is not finite");
    if (s.radius < 0.0) return fail(ErrorKind::usage, "the radius of the focus is negative");
    if (largest_coordinate(s.centre) > kLargest || s.radius > kLargest) {
      return fail(ErrorKind::usage, "the focus is beyond 1e70");
    }
  }
  if (focus.facing) {
    const FocusFacing& f = *focus.facing;
    if (!finite(f.direction) || !std::isfinite(f.angle_deg)) {
      return fail(ErrorKind::usage, "the direction of the focus is not finite");
    }
    const double largest = largest_coordinate(f.direction);
    if (largest < 1e-100 || largest > 1e100) return fail(ErrorKind::usage, "the direction of the focus is zero");
    if (f.angle_deg < 0.0 || f.angle_deg > 180.0) {
      return fail(ErrorKind::usage, "the angle of the focus is outside 0 to 180 degrees");
    }
  }
  return {};
}

FocusTest::FocusTest(const Focus& focus) : focus_(focus) {
  if (!focus_.facing) return;
  direction_ = glm::normalize(focus_.facing->direction / largest_coordinate(focus_.facing->direction));
  cos_angle_ = std::cos(focus_.facing->angle_deg * std::numbers::pi / 180.0);
}

bool FocusTest::may_touch(const Bounds& box) const {
  if (focus_.sphere) {
    const FocusSphere& s = *focus_.sphere;
    const glm::dvec3 gap = glm::max(glm::max(box.low - s.centre, s.centre - box.high), glm::dvec3(0.0));
    const double reach = s.radius + kSlack * (s.radius + largest_coordinate(s.centre));
    if (!(glm::dot(gap, gap) <= reach * reach)) return false;
  }
  return !focus_.region || focus_.region(box);
}

bool FocusTest::may_hold(const CodedCone& cone) const {
  if (!focus_.facing || cone.cosine() <= -1.0F) return true;
  const double half = std::acos(std::min(1.0, static_cast<double>(cone.cosine())));
  const double between = std::acos(std::clamp(glm::dot(glm::dvec3(cone.axis()), direction_), -1.0, 1.0));
  return between <= half + focus_.facing->angle_deg * std::numbers::pi / 180.0 + kAngleSlack;
}

bool FocusTest::holds(const std::array<glm::dvec3, 3>& corners) const {
  if (is_empty()) return false;
  if (focus_.sphere) {
    const glm::dvec3 gap =
        closest_point_on_triangle(focus_.sphere->centre, corners[0], corners[1], corners[2]) - focus_.sphere->centre;
    if (glm::dot(gap, gap) > focus_.sphere->radius * focus_.sphere->radius) return false;
  }
  if (focus_.facing) {
    const glm::dvec3 normal = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
    const double length = glm::length(normal);
    if (!(length > 0.0) || glm::dot(normal, direction_) < cos_angle_ * length) return false;
  }
  if (!focus_.region) return true;
  const glm::dvec3 low = glm::min(glm::min(corners[0], corners[1]), corners[2]);
  return focus_.region({low, glm::max(glm::max(corners[0], corners[1]), corners[2])});
}

}  // namespace fanstream
