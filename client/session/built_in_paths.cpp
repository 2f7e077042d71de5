#include "client/session/built_in_paths.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <numbers>

namespace fanstream {
namespace {

constexpr double kMargin = 0.05;  // of the picture, left free on each side where the whole model is seen

// The model's box with room in it, and the directions a viewer thinks in.
struct Stage {
  glm::dvec3 center{0.0};
  glm::dvec3 half{0.0};                                    // of the box along the model's axes
  double radius = 1.0;                                     // of the ball around the box
  glm::dvec3 right{1, 0, 0}, up{0, 1, 0}, front{0, 0, 1};  // orthonormal; front is towards the viewer

  // Half the box's extent along a unit vector.
  double extent(const glm::dvec3& direction) const { return glm::dot(half, glm::abs(direction)); }
  // How far along a unit vector from the centre the box ends.
  double way_out(const glm::dvec3& direction) const {
    double out = radius;
    for (int axis = 0; axis < 3; ++axis) {
      if (std::abs(direction[axis]) > 1e-9) out = std::min(out, half[axis] / std::abs(direction[axis]));
    }
    return out;
  }
  glm::dvec3 direction(double azimuth_deg, double elevation_deg) const {
    const double a = glm::radians(azimuth_deg);
    const double e = glm::radians(elevation_deg);
    return (right * std::sin(a) + front * std::cos(a)) * std::cos(e) + up * std::sin(e);
  }
};

Stage stage_of(const Bounds& bounds, const glm::dvec3& up) {
  constexpr double kLargest = 1e90;
  const glm::dvec3 low = glm::clamp(bounds.low, -kLargest, kLargest);
  const glm::dvec3 high = glm::clamp(bounds.high, -kLargest, kLargest);
  Stage stage;
  stage.center = (low + high) * 0.5;
  stage.half = glm::abs(high - low) * 0.5;
  const glm::dvec3 away = glm::abs(stage.center);
  const double least = std::max(1e-12 * std::max({away.x, away.y, away.z}), 1e-90);
  stage.radius = glm::length(stage.half);
  if (!(stage.radius >= least)) stage.radius = stage.radius > 0.0 ? least : std::max(least, 1.0);
  stage.up = glm::normalize(up);
  const glm::dvec3 facing = std::abs(stage.up.z) > std::abs(stage.up.y) ? glm::dvec3(0, -1, 0) : glm::dvec3(0, 0, 1);
  stage.right = glm::normalize(glm::cross(stage.up, facing));
  stage.front = glm::cross(stage.right, stage.up);
  return stage;
}

// The least distance from the centre at which all of the box is seen from a direction.
double distance_to_see(const Stage& stage, const glm::dvec3& to_eye, const BuiltInPathOptions& options) {
  const double slope_y = std::tan(glm::radians(options.fov_deg) / 2) * (1.0 - 2.0 * kMargin);
  const double slope_x = slope_y * options.width / options.height;
  const glm::dvec3 right = glm::normalize(glm::cross(stage.up, to_eye));
  const glm::dvec3 up = glm::cross(to_eye, right);
  double distance = stage.radius * 1.1;
  for (unsigned corner = 0; corner < 8; ++corner) {
    const glm::dvec3 p =
        stage.half * glm::dvec3((corner & 1U) != 0 ? 1 : -1, (corner & 2U) != 0 ? 1 : -1, (corner & 4U) != 0 ? 1 : -1);
    const double depth = glm::dot(p, to_eye);
    distance = std::max(
        {distance, std::abs(glm::dot(p, right)) / slope_x + depth, std::abs(glm::dot(p, up)) / slope_y + depth});
  }
  return distance;
}

CameraPath start(const char* name, const BuiltInPathOptions& options) {
  CameraPath path;
  path.name = name;
  path.fps = options.fps;
  path.width = options.width;
  path.height = options.height;
  return path;
}

CameraKeyframe look(double time_s, const glm::dvec3& eye, const glm::dvec3& target, const Stage& stage,
                    const BuiltInPathOptions& options) {
  return {time_s, {eye, target, stage.up, options.fov_deg}, options.tolerance_px, {}, false};
}

}  // namespace

CameraPath orbit_path(const Bounds& bounds, const BuiltInPathOptions& options) {
  constexpr int kSteps = 24;
  constexpr double kSeconds = 12.0;
  const Stage stage = stage_of(bounds, options.up);
  const auto direction = [&stage](int step) { return stage.direction(360.0 * step / kSteps, 18.0); };
  double distance = 0.0;
  for (int i = 0; i < kSteps; ++i) distance = std::max(distance, distance_to_see(stage, direction(i), options));
  CameraPath path = start("orbit", options);
  for (int i = 0; i <= kSteps; ++i) {
    const glm::dvec3 eye = stage.center + direction(i % kSteps) * distance;
    path.keyframes.push_back(look(kSeconds * i / kSteps, eye, stage.center, stage, options));
  }
  return path;
}

CameraPath approach_path(const Bounds& bounds, const BuiltInPathOptions& options) {
  const Stage stage = stage_of(bounds, options.up);
  const glm::dvec3 to_eye = stage.direction(25.0, 18.0);
  const glm::dvec3 far = stage.center + to_eye * distance_to_see(stage, to_eye, options);
  const glm::dvec3 near = stage.center + to_eye * (stage.way_out(to_eye) + 0.2 * stage.radius);
  CameraPath path = start("approach", options);
  path.keyframes.push_back(look(0.0, far, stage.center, stage, options));
  path.keyframes.push_back(look(2.0, far, stage.center, stage, options));
  path.keyframes.push_back(look(8.0, near, stage.center, stage, options));
  path.keyframes.push_back(look(12.0, near, stage.center, stage, options));
  return path;
}

CameraPath fly_by_path(const Bounds& bounds, const BuiltInPathOptions& options) {
  constexpr int kSteps = 6;
  constexpr double kSeconds = 12.0;
  const Stage stage = stage_of(bounds, options.up);
  // Along the wider of the two horizontal extents, past the side that faces the viewer.
  const bool across = stage.extent(stage.right) >= stage.extent(stage.front);
  const glm::dvec3 along = across ? stage.right : -stage.front;
  const glm::dvec3 side = across ? stage.front : stage.right;
  const double clearance = stage.extent(side) + 0.45 * stage.radius;
  const double length = stage.extent(along) + 1.1 * stage.radius;
  CameraPath path = start("fly-by", options);
  for (int i = 0; i <= kSteps; ++i) {
    const double s = 2.0 * i / kSteps - 1.0;
    const glm::dvec3 eye = stage.center + along * (length * s) + side * clearance + stage.up * (0.25 * stage.radius);
    const glm::dvec3 target = stage.center + along * (0.3 * length * s);
    path.keyframes.push_back(look(kSeconds * i / kSteps, eye, target, stage, options));
  }
  return path;
}

CameraPath jump_path(const Bounds& bounds, const BuiltInPathOptions& options) {
  constexpr double kSeconds = 5.0;
  const Stage stage = stage_of(bounds, options.up);
  CameraPath path = start("jump", options);
  for (int i = 0; i < 2; ++i) {
    const glm::dvec3 to_eye = stage.direction(30.0 + 180.0 * i, 12.0);
    const glm::dvec3 eye = stage.center + to_eye * (stage.way_out(to_eye) + 0.7 * stage.radius);
    path.keyframes.push_back(look(kSeconds * i, eye, stage.center, stage, options));
    path.keyframes.back().cut = i > 0;
  }
  path.keyframes.push_back(path.keyframes.back());
  path.keyframes.back().time_s = 2 * kSeconds;
  path.keyframes.back().cut = false;
  return path;
}

std::optional<CameraPath> built_in_path(std::string_view name, const Bounds& bounds,
                                        const BuiltInPathOptions& options) {
  if (name == "orbit") return orbit_path(bounds, options);
  if (name == "approach") return approach_path(bounds, options);
  if (name == "fly-by") return fly_by_path(bounds, options);
  if (name == "jump") return jump_path(bounds, options);
  return std::nullopt;
}

}  // namespace fanstream
