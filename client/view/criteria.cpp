#include "client/view/criteria.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <utility>

namespace fanstream {
namespace {

constexpr std::uint32_t kMostPixels = 1U << 16;
constexpr double kDegrees = std::numbers::pi / 180.0;

bool finite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }
bool sensible(double v) { return std::isfinite(v) && v >= 0.0; }

// From `inside` at 0 to `outside` at `falloff`.
double fade(double gap, double falloff, double inside, double outside) {
  if (!(gap > 0.0)) return inside;
  if (gap >= falloff) return outside;
  return inside + (outside - inside) * (gap / falloff);
}

}  // namespace

bool operator==(const View& a, const View& b) {
  return a.camera.eye == b.camera.eye && a.camera.target == b.camera.target && a.camera.up == b.camera.up &&
         a.camera.fov_deg == b.camera.fov_deg && a.width_px == b.width_px && a.height_px == b.height_px &&
         a.near_distance == b.near_distance;
}

Result<void> check_view(const View& view) {
  if (Result<void> camera = check_camera(view.camera); !camera) return camera;
  if (view.width_px == 0 || view.height_px == 0 || view.width_px > kMostPixels || view.height_px > kMostPixels) {
    return fail(ErrorKind::usage, fmt::format("view: a picture of {} x {} pixels; each side must be 1 to {}",
                                              view.width_px, view.height_px, kMostPixels));
  }
  if (!std::isfinite(view.near_distance)) return fail(ErrorKind::usage, "view: the near distance must be finite");
  return {};
}

Result<void> check_criteria(const Criteria& criteria) {
  for (const double v : {criteria.offscreen_weight, criteria.frustum_falloff, criteria.back_facing_weight,
                         criteria.silhouette_weight, criteria.facing_falloff}) {
    if (!sensible(v)) return fail(ErrorKind::usage, "criteria: weights and falloffs must be finite and at least 0");
  }
  if (const auto& focus = criteria.focus_point) {
    if (!finite(focus->position) || !sensible(focus->radius) || !sensible(focus->falloff) ||
        !sensible(focus->outside_weight))
      return fail(ErrorKind::usage, "focus point: all numbers must be finite, radius, falloff and weight at least 0");
  }
  if (const auto& focus = criteria.focus_direction) {
    const double length = glm::length(focus->direction);
    if (!finite(focus->direction) || !std::isfinite(length) || !(length > 0.0) || !sensible(focus->angle_deg) ||
        !sensible(focus->falloff_deg) || !sensible(focus->outside_weight))
      return fail(ErrorKind::usage,
                  "focus direction: it must be finite and not zero, angles and weight finite and at least 0");
  }
  return {};
}

double ProjectedError::px(double error) const {
  const double distance = std::max({near, depth - error, slant - 2.0 * error});
  return scale_px * error / distance;
}

void narrow(CellJudgement& part, const CellJudgement& whole) {
  part.error.scale_px = std::min(part.error.scale_px, whole.error.scale_px);
  part.error.depth = std::max(part.error.depth, whole.error.depth);
  part.error.slant = std::max(part.error.slant, whole.error.slant);
  part.in_frustum = part.in_frustum && whole.in_frustum;
  if (whole.facing == Facing::front || whole.facing == Facing::back) part.facing = whole.facing;
}

// A sphere as seen from the eye.
struct ViewJudge::EyeSphere {
  glm::dvec3 offset{0.0};  // from the eye to the centre
  double x = 0.0, y = 0.0, depth = 0.0;
  double distance_square = 0.0;
  double radius = 0.0;        // of the original's part
  double drawn_radius = 0.0;  // of whatever may be drawn for it

  // Of the largest angle off the axis; -1 where the eye is within.
  double least_cosine() const {
    const double room_square = distance_square - drawn_radius * drawn_radius;
    if (!(room_square > 0.0)) return -1.0;
    return (depth * std::sqrt(room_square) - std::sqrt(x * x + y * y) * drawn_radius) / distance_square;
  }
};

ViewJudge::EyeSphere ViewJudge::eye_sphere(const glm::dvec3& center, double radius, double largest_error) const {
  EyeSphere s;
  s.offset = center - eye_;
  s.x = glm::dot(s.offset, right_);
  s.y = glm::dot(s.offset, up_);
  s.depth = glm::dot(s.offset, forward_);
  s.distance_square = glm::dot(s.offset, s.offset);
  s.radius = radius;
  s.drawn_radius = radius + largest_error;
  return s;
}

ViewJudge::ViewJudge(const View& view, const Criteria& criteria) : criteria_(criteria), eye_(view.camera.eye) {
  const glm::dvec3 to_target = view.camera.target - eye_;
  forward_ = glm::normalize(to_target);
  right_ = glm::normalize(glm::cross(forward_, glm::normalize(view.camera.up)));
  up_ = glm::cross(right_, forward_);
  tan_y_ = std::tan(view.camera.fov_deg * kDegrees / 2.0);
  tan_x_ = tan_y_ * view.width_px / view.height_px;
  norm_x_ = 1.0 / std::sqrt(1.0 + tan_x_ * tan_x_);
  norm_y_ = 1.0 / std::sqrt(1.0 + tan_y_ * tan_y_);
  cos_corner_ = 1.0 / std::sqrt(1.0 + tan_x_ * tan_x_ + tan_y_ * tan_y_);
  focal_px_ = view.height_px / (2.0 * tan_y_);
  near_ = view.near_distance > 0.0 ? view.near_distance : 1e-3 * glm::length(to_target);
  near_ = std::max(near_, 1e-150);
  picture_area_px_ = static_cast<double>(view.width_px) * view.height_px;
  if (criteria_.focus_direction) focus_direction_ = glm::normalize(criteria_.focus_direction->direction);
}

CellJudgement ViewJudge::judge(const CellExtent& extent, double largest_error,
                               std::span<const ExtentPart> parts) const {
  const EyeSphere s = eye_sphere(extent.center, extent.radius, largest_error);
  const double distance = std::sqrt(s.distance_square);
  double cosine = s.least_cosine();
  double depth = s.depth - s.radius;
  Gaps outside = gaps(s);
  if (!parts.empty()) {
    double hull_cosine = 1.0;
    double hull_depth = std::numeric_limits<double>::infinity();
    Gaps hull;
    hull.fill(hull_depth);
    for (const ExtentPart& part : parts) {
      const EyeSphere p = eye_sphere(part.center, part.radius, largest_error);
      hull_cosine = std::min(hull_cosine, p.least_cosine());
      hull_depth = std::min(hull_depth, p.depth - p.radius);
      const Gaps of_part = gaps(p);
      for (std::size_t i = 0; i < hull.size(); ++i) hull[i] = std::min(hull[i], of_part[i]);
    }
    cosine = std::max(cosine, hull_cosine);
    depth = std::max(depth, hull_depth);
    for (std::size_t i = 0; i < hull.size(); ++i) outside[i] = std::max(outside[i], hull[i]);
  }
  cosine = std::max(cosine, cos_corner_);

  CellJudgement result;
  result.error = {focal_px_ / cosine, depth, cosine * (distance - s.radius), near_};
  const double size_px = focal_px_ * s.radius / std::max(near_, distance);
  result.area_px = std::min(picture_area_px_, std::numbers::pi * size_px * size_px);
  const double frustum = frustum_weight(*std::max_element(outside.begin(), outside.end()), distance, result);
  facing_weights(extent, parts, distance, result);
  const double common = frustum * focus_weight(extent);
  result.weight *= common;
  result.weight_within *= common;
  return result;
}

CellJudgement ViewJudge::anywhere() const {
  CellJudgement result;
  result.error = {focal_px_ / cos_corner_, near_, near_, near_};
  result.area_px = picture_area_px_;
  return result;
}

// How far a sphere is beyond each side of the frustum at least.
ViewJudge::Gaps ViewJudge::gaps(const EyeSphere& s) const {
  return {near_ - s.depth - s.drawn_radius, (s.x - s.depth * tan_x_) * norm_x_ - s.drawn_radius,
          (-s.x - s.depth * tan_x_) * norm_x_ - s.drawn_radius, (s.y - s.depth * tan_y_) * norm_y_ - s.drawn_radius,
          (-s.y - s.depth * tan_y_) * norm_y_ - s.drawn_radius};
}

double ViewJudge::frustum_weight(double gap, double distance, CellJudgement& result) const {
  result.in_frustum = !(gap > 0.0);
  if (result.in_frustum || !criteria_.use_frustum) return 1.0;
  return fade(gap, criteria_.frustum_falloff * distance, 1.0, criteria_.offscreen_weight);
}

void ViewJudge::facing_weights(const CellExtent& extent, std::span<const ExtentPart> parts, double distance,
                               CellJudgement& result) const {
  if (!(extent.cone_cosine > -1.0)) return;
  result.facing = Facing::mixed;
  double margin = -1.0;
  // Cones of 90 degrees and more hold normals of both kinds, whatever the sphere.
  if (extent.cone_cosine > 0.0) {
    const double sine = std::sqrt(std::max(0.0, 1.0 - extent.cone_cosine * extent.cone_cosine));
    // How surely a sphere looks away from the eye, and towards it.
    const auto margins = [&](const glm::dvec3& center, double radius) {
      const glm::dvec3 offset = center - eye_;
      const double along = glm::dot(extent.cone_axis, offset);
      const double across = std::sqrt(std::max(0.0, glm::dot(offset, offset) - along * along));
      return std::pair{along * extent.cone_cosine - across * sine - radius,
                       -along * extent.cone_cosine - across * sine - radius};
    };
    auto [back, front] = margins(extent.center, extent.radius);
    if (!parts.empty()) {
      double hull_back = std::numeric_limits<double>::infinity();
      double hull_front = hull_back;
      for (const ExtentPart& part : parts) {
        const auto [part_back, part_front] = margins(part.center, part.radius);
        hull_back = std::min(hull_back, part_back);
        hull_front = std::min(hull_front, part_front);
      }
      back = std::max(back, hull_back);
      front = std::max(front, hull_front);
    }
    margin = std::max(back, front);
    if (margin > 0.0) result.facing = back > 0.0 ? Facing::back : Facing::front;
  }
  if (!criteria_.use_facing) return;
  const double side = result.facing == Facing::back ? criteria_.back_facing_weight : 1.0;
  const double falloff = criteria_.facing_falloff * distance;
  result.weight = fade(margin, falloff, criteria_.silhouette_weight, side);
  result.weight_within = fade(margin, falloff, std::min(1.0, criteria_.silhouette_weight), side);
}

double ViewJudge::focus_weight(const CellExtent& extent) const {
  double weight = 1.0;
  if (const auto& focus = criteria_.focus_point) {
    const double gap = glm::length(extent.center - focus->position) - extent.radius - focus->radius;
    weight *= fade(gap, focus->falloff > 0.0 ? focus->falloff : focus->radius, 1.0, focus->outside_weight);
  }
  if (const auto& focus = criteria_.focus_direction; focus && extent.cone_cosine > -1.0) {
    const double angle = std::acos(std::clamp(glm::dot(extent.cone_axis, focus_direction_), -1.0, 1.0)) -
                         std::acos(std::min(1.0, extent.cone_cosine));
    weight *= fade(angle / kDegrees - focus->angle_deg, focus->falloff_deg, 1.0, focus->outside_weight);
  }
  return weight;
}

}  // namespace fanstream
