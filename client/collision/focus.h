// Where a model is to be original: near a point, where it looks into a direction, or in a region of the caller's.
//
// Source: Odauchi, Tsukiji, "Real-time local mesh simplification and its application": polygons are restored by their
// distance to a point P and by the angle between a vector (the camera's direction) and their normals.
#pragma once

#include <functional>
#include <glm/vec3.hpp>
#include <optional>

#include "common/asset/coded_cone.h"
#include "common/mesh/triangle_mesh.h"
#include "common/support/result.h"

namespace fanstream {

// In the model's coordinates. A radius of 0 is a point.
struct FocusSphere {
  glm::dvec3 centre{0.0};
  double radius = 0.0;
};

// Normals within angle_deg (0 to 180) of a direction of any length: for what faces the camera, from target to eye.
struct FocusFacing {
  glm::dvec3 direction{0.0, 0.0, 1.0};
  double angle_deg = 60.0;
};

// What of these is given must all hold; where nothing is given, nothing is in focus.
struct Focus {
  std::optional<FocusSphere> sphere = {};
  std::optional<FocusFacing> facing = {};
  // A region of any other shape: whether it may reach into a box. May answer true where it does not.
  std::function<bool(const Bounds& box)> region = {};
};

// Fails (usage) where a number is not finite, a radius negative, an angle outside [0, 180] or a direction zero.
Result<void> check_focus(const Focus& focus);

// A focus prepared for many tests. It must have passed its check. Thread safe.
class FocusTest {
 public:
  explicit FocusTest(const Focus& focus);
  bool is_empty() const { return !focus_.sphere && !focus_.facing && !focus_.region; }
  // Whether a triangle in the box may be in focus: never false where one is.
  bool may_touch(const Bounds& box) const;
  // Whether a triangle with one of the cone's normals may be.
  bool may_hold(const CodedCone& cone) const;
  // Whether the triangle is in focus: comes within the radius of the centre and looks into the direction, where these
  // are given; a triangle without area looks nowhere. A region is asked about the triangle's box.
  bool holds(const std::array<glm::dvec3, 3>& corners) const;
  const std::optional<FocusSphere>& sphere() const { return focus_.sphere; }
  const std::function<bool(const Bounds&)>& region() const { return focus_.region; }

 private:
  Focus focus_;
  glm::dvec3 direction_{0.0};  // of length 1
  double cos_angle_ = -1.0;
};

}  // namespace fanstream
