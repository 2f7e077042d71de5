#include "tests/bench/close_up.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <utility>

#include "tests/bench/view_bytes.h"

namespace fanstream::bench {

namespace {

double tan_half_height(const View& view) { return std::tan(view.camera.fov_deg * std::numbers::pi / 360.0); }

// As far from `point` as said, on the line to where the eye was.
View moved_to(const View& from, const glm::dvec3& point, double distance, const Bounds& bounds) {
  View view = from;
  view.camera.target = point;
  view.camera.eye = point + glm::normalize(from.camera.eye - point) * distance;
  view.near_distance = depth_range(view.camera, bounds).near_distance;
  return view;
}

// Of the vertices that are at most so far off the line of sight, the one nearest to the eye; if there are none, the one
// nearest to the line.
glm::dvec3 middle_of_picture(const TriangleMesh& mesh, const View& view, double most_off) {
  const glm::dvec3& eye = view.camera.eye;
  const glm::dvec3 forward = glm::normalize(view.camera.target - eye);
  std::pair<double, double> best{std::numeric_limits<double>::infinity(), 0.0};  // how far off the line, depth
  glm::dvec3 found{0.0};
  for (const Triangle& t : mesh.triangles) {
    for (const VertexId v : t) {
      const glm::dvec3 offset = mesh.positions[v] - eye;
      const double depth = glm::dot(offset, forward);
      const std::pair rank{std::max(most_off, glm::length(offset - depth * forward)), depth};
      if (rank >= best) continue;
      best = rank;
      found = mesh.positions[v];
    }
  }
  return found;
}

Result<std::uint64_t> bytes_wanted(const std::shared_ptr<const OpenAsset>& asset, const View& view,
                                   const PlanOptions& options, StopAt stop) {
  Result<ViewDelivery> delivery = ViewDelivery::start(asset);
  if (!delivery) return tl::unexpected(delivery.error());
  const Result<ViewBytes> bytes = delivery->deliver(view, options, stop);
  if (!bytes) return tl::unexpected(bytes.error());
  return bytes->segment_bytes;
}

std::uint64_t bytes_above(const OpenAsset& asset, double error) {
  const AssetIndex& index = *asset.asset_index();
  const double step = asset.asset_head()->grid.step();
  std::uint64_t bytes = 0;
  for (const SegmentEntry& segment : index.segments) {
    if (error_from_code(segment.error_code, step) > error) bytes += segment.size_bytes;
  }
  return bytes;
}

}  // namespace

double share_in_picture(const TriangleMesh& mesh, const View& view, Counted counted) {
  const glm::dmat4 to_eye = view_matrix(view.camera);
  const double tan_y = tan_half_height(view);
  const double tan_x = tan_y * view.width_px / view.height_px;
  double all = 0.0;
  double seen = 0.0;
  for (const Triangle& t : mesh.triangles) {
    const glm::dvec3& a = mesh.positions[t[0]];
    const glm::dvec3& b = mesh.positions[t[1]];
    const glm::dvec3& c = mesh.positions[t[2]];
    const glm::dvec3 normal = glm::cross(b - a, c - a);
    const double area = glm::length(normal);
    all += area;
    if (counted == Counted::facing && !(glm::dot(normal, view.camera.eye - a) > 0.0)) continue;
    const glm::dvec3 p(to_eye * glm::dvec4((a + b + c) / 3.0, 1.0));
    const double depth = -p.z;
    if (depth >= view.near_distance && std::abs(p.x) <= tan_x * depth && std::abs(p.y) <= tan_y * depth) seen += area;
  }
  return all > 0.0 ? seen / all : 0.0;
}

CloseView close_view(const TriangleMesh& mesh, double share, Counted counted) {
  const View whole = whole_view(mesh.positions);
  const Bounds bounds = bounds_of(mesh.positions);
  const glm::dvec3 aim = middle_of_picture(mesh, whole, 0.02 * bounds.diagonal());
  double high = glm::length(whole.camera.eye - aim);
  double low = 1e-3 * high;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (share_in_picture(mesh, moved_to(whole, aim, middle, bounds), counted) < share ? low : high) = middle;
  }
  CloseView result;
  result.view = moved_to(whole, aim, high, bounds);
  result.distance = high;
  result.share = share_in_picture(mesh, result.view);
  result.facing_share = share_in_picture(mesh, result.view, Counted::facing);
  return result;
}

Result<CloseUp> measure_close_up(const std::shared_ptr<const OpenAsset>& asset, const TriangleMesh& full, double share,
                                 Counted counted, double tolerance_px) {
  CloseUp result;
  result.counted = counted;
  result.view = close_view(full, share, counted);
  result.tolerance_px = tolerance_px;
  PlanOptions options;
  options.criteria = plain_criteria();
  options.tolerance_px = tolerance_px;
  options.speculate = false;  // there is no round trip to be saved, and what comes of it is not needed
  Result<std::uint64_t> bytes = bytes_wanted(asset, result.view.view, options, StopAt::stated_error);
  if (!bytes) return tl::unexpected(bytes.error());
  result.in_picture_bytes = *bytes;
  options.criteria.use_frustum = false;
  bytes = bytes_wanted(asset, result.view.view, options, StopAt::nothing_wanted);
  if (!bytes) return tl::unexpected(bytes.error());
  result.facing_bytes = *bytes;
  options.criteria.use_facing = false;
  bytes = bytes_wanted(asset, result.view.view, options, StopAt::nothing_wanted);
  if (!bytes) return tl::unexpected(bytes.error());
  result.everything_bytes = *bytes;
  const View& view = result.view.view;
  const double focal_px = 0.5 * view.height_px / tan_half_height(view);
  result.even_bytes = bytes_above(*asset, tolerance_px * result.view.distance / focal_px);
  return result;
}

}  // namespace fanstream::bench
