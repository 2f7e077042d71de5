#include "client/view/camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/trigonometric.hpp>
#include <limits>

namespace fanstream {
namespace {

bool finite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

std::array<glm::dvec3, 8> corners(const Bounds& bounds) {
  std::array<glm::dvec3, 8> all;
  for (std::size_t i = 0; i < 8; ++i) {
    all[i] = {(i & 1U) != 0 ? bounds.high.x : bounds.low.x, (i & 2U) != 0 ? bounds.high.y : bounds.low.y,
              (i & 4U) != 0 ? bounds.high.z : bounds.low.z};
  }
  return all;
}

// The extent of points along one picture axis, seen from infinitely far along the edges of the frustum: the frustum of
// half-width `slope` per unit of depth touches points where across - slope * depth and -across - slope * depth are
// largest.
struct Wedge {
  double slope;
  double positive = -std::numeric_limits<double>::infinity();
  double negative = -std::numeric_limits<double>::infinity();
  void add(double across, double depth) {
    positive = std::max(positive, across - slope * depth);
    negative = std::max(negative, -across - slope * depth);
  }
  double apex_across() const { return (positive - negative) / 2; }
  double apex_depth() const { return -(positive + negative) / (2 * slope); }
};

}  // namespace

Result<void> check_camera(const Camera& camera) {
  if (!finite(camera.eye) || !finite(camera.target) || !finite(camera.up) || !std::isfinite(camera.fov_deg)) {
    return fail(ErrorKind::usage, "camera: eye, target, up and field of view must be finite numbers");
  }
  if (camera.fov_deg < 1.0 || camera.fov_deg > 170.0) {
    return fail(ErrorKind::usage, fmt::format("camera: field of view {} is outside 1 to 170 degrees", camera.fov_deg));
  }
  const glm::dvec3 forward = camera.target - camera.eye;
  const double distance = glm::length(forward);
  if (!(distance > 0.0) || !std::isfinite(distance)) {
    return fail(ErrorKind::usage, "camera: eye and target must be different points, and not absurdly far apart");
  }
  const double up_length = glm::length(camera.up);
  if (!(up_length > 0.0) || !std::isfinite(up_length) ||
      glm::length(glm::cross(forward / distance, camera.up / up_length)) < 1e-9) {
    return fail(ErrorKind::usage, "camera: up must not be zero or parallel to the view; give another --up or --eye");
  }
  return {};
}

DepthRange depth_range(const Camera& camera, const Bounds& bounds) {
  const glm::dvec3 forward = glm::normalize(camera.target - camera.eye);
  double nearest = std::numeric_limits<double>::infinity();
  double farthest = 0.0;
  for (const glm::dvec3& corner : corners(bounds)) {
    const double depth = glm::dot(corner - camera.eye, forward);
    nearest = std::min(nearest, depth);
    farthest = std::max(farthest, depth);
  }
  if (!(farthest > 0.0))
    return {glm::length(camera.target - camera.eye) * 0.5, glm::length(camera.target - camera.eye)};
  // Room to spare, so that nothing is cut by rounding.
  farthest *= 1.01;
  return {std::max(nearest * 0.99, farthest * 1e-3), farthest};
}

glm::dmat4 view_matrix(const Camera& camera) { return glm::lookAt(camera.eye, camera.target, camera.up); }

glm::dmat4 projection_matrix(const Camera& camera, double aspect, const DepthRange& depth) {
  return glm::perspective(glm::radians(camera.fov_deg), aspect, depth.near_distance, depth.far_distance);
}

Camera fit(std::span<const glm::dvec3> points, const FitOptions& options) {
  const glm::dvec3 forward = glm::normalize(-options.from);
  const glm::dvec3 right = glm::normalize(glm::cross(forward, options.up));
  const glm::dvec3 up = glm::cross(right, forward);
  const double slope = std::tan(glm::radians(options.fov_deg) / 2) * (1.0 - 2.0 * options.margin);
  Wedge horizontal{slope * options.aspect};
  Wedge vertical{slope};
  double nearest = std::numeric_limits<double>::infinity();
  double farthest = -std::numeric_limits<double>::infinity();
  for (const glm::dvec3& point : points) {
    const double depth = glm::dot(point, forward);
    horizontal.add(glm::dot(point, right), depth);
    vertical.add(glm::dot(point, up), depth);
    nearest = std::min(nearest, depth);
    farthest = std::max(farthest, depth);
  }
  Camera camera;
  camera.up = up;
  camera.fov_deg = options.fov_deg;
  if (points.empty()) return camera;
  const double middle = (nearest + farthest) / 2;
  double eye_depth = std::min(horizontal.apex_depth(), vertical.apex_depth());
  const glm::dvec3 across = right * horizontal.apex_across() + up * vertical.apex_across();
  if (!(middle - eye_depth > 1e-12 * std::max({1e-290, std::abs(middle), glm::length(across)})))
    eye_depth = middle - 1.0;
  camera.eye = across + forward * eye_depth;
  camera.target = across + forward * middle;
  return camera;
}

Camera fit(const Bounds& bounds, const FitOptions& options) { return fit(corners(bounds), options); }

}  // namespace fanstream
