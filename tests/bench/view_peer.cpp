#include "tests/bench/view_peer.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <map>

#include "common/geometry/triangle_tree.h"
#include "tests/bench/peer_level.h"
#include "tests/bench/view_bytes.h"

namespace fanstream::bench {

namespace {

bool faces_eye(const TriangleMesh& mesh, const Triangle& t, const View& view) {
  const glm::dvec3& a = mesh.positions[t[0]];
  const glm::dvec3 normal = glm::cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a);
  return glm::dot(normal, view.camera.eye - a) > 0.0;
}

TriangleMesh facing_part(const TriangleMesh& mesh, const View& view) {
  constexpr VertexId kUnused = 0xFFFFFFFFU;
  std::vector<VertexId> number(mesh.positions.size(), kUnused);
  TriangleMesh part;
  for (Triangle t : mesh.triangles) {
    if (!faces_eye(mesh, t, view)) continue;
    for (VertexId& v : t) {
      if (number[v] == kUnused) {
        number[v] = static_cast<VertexId>(part.positions.size());
        part.positions.push_back(mesh.positions[v]);
      }
      v = number[v];
    }
    part.triangles.push_back(t);
  }
  return part;
}

// Levels are measured once, whatever tolerance asks.
class PeerLevels {
 public:
  PeerLevels(const TriangleMesh& full, const PositionGrid& grid, const PictureError& error)
      : full_(full), grid_(grid), error_(error) {}

  Result<ViewPeer> within(double tolerance_px, const View& view) {
    const auto is_good_enough = [&](std::size_t triangles) -> Result<bool> {
      const Result<double> error = error_of(triangles);
      if (!error) return tl::unexpected(error.error());
      return *error <= tolerance_px;
    };
    const Result<std::size_t> triangles = fewest_triangles(full_.triangles.size(), is_good_enough);
    if (!triangles) return tl::unexpected(triangles.error());
    const Result<TriangleMesh> level = peer_level(full_, *triangles, grid_);
    if (!level) return tl::unexpected(level.error());
    const Result<double> error = error_of(*triangles);
    if (!error) return tl::unexpected(error.error());
    const Result<std::size_t> bytes = draco_bytes(*level, grid_);
    if (!bytes) return tl::unexpected(bytes.error());
    ViewPeer peer{*error, static_cast<std::uint32_t>(level->triangles.size()), *bytes, 0};
    const TriangleMesh facing = facing_part(*level, view);
    if (facing.triangles.empty()) return peer;
    const Result<std::size_t> facing_bytes = draco_bytes(facing, grid_);
    if (!facing_bytes) return tl::unexpected(facing_bytes.error());
    peer.facing_bytes = *facing_bytes;
    return peer;
  }

 private:
  Result<double> error_of(std::size_t triangles) {
    if (const auto found = errors_.find(triangles); found != errors_.end()) return found->second;
    const Result<TriangleMesh> level = peer_level(full_, triangles, grid_);
    if (!level) return tl::unexpected(level.error());
    Result<double> error = error_.of(*level);
    if (error) errors_[triangles] = *error;
    return error;
  }

  const TriangleMesh& full_;
  const PositionGrid& grid_;
  const PictureError& error_;
  std::map<std::size_t, double> errors_;  // by triangles asked for
};

Result<ViewBesidePeer> deliver(const std::shared_ptr<const OpenAsset>& asset, const View& view, double tolerance_px,
                               const PictureError& error) {
  PlanOptions options;
  options.criteria = plain_criteria();
  options.tolerance_px = tolerance_px;
  Result<ViewDelivery> delivery = ViewDelivery::start(asset);
  if (!delivery) return tl::unexpected(delivery.error());
  const Result<ViewBytes> delivered = delivery->deliver(view, options, StopAt::stated_error);
  if (!delivered) return tl::unexpected(delivered.error());
  const Result<double> measured = error.of(delivery->model().mesh().triangle_mesh());
  if (!measured) return tl::unexpected(measured.error());
  const std::size_t bytes = asset->head().size() + asset->index().size() + delivered->segment_bytes;
  return ViewBesidePeer{tolerance_px, bytes, delivered->stated_error_px, *measured, {}};
}

}  // namespace

PictureError::PictureError(const TriangleMesh& full, const View& view, std::size_t samples) : projection_(view) {
  for (const SpreadPoint& point : spread_points(full, samples)) {
    if (!faces_eye(full, full.triangles[point.face], view)) continue;
    if (projection_.is_drawn(point.place) && projection_.in_picture(point.place)) samples_.push_back(point);
  }
}

Result<double> PictureError::of(const TriangleMesh& shown) const {
  const Result<TriangleTree> tree = TriangleTree::build(shown);
  if (!tree) return tl::unexpected(tree.error());
  double most = 0.0;
  std::uint32_t hint = 0;
  for (const SpreadPoint& sample : samples_) {
    const SurfacePoint nearest = tree->closest(sample.place, hint);
    hint = nearest.slot;
    if (projection_.depth(nearest.position) <= 0.0) continue;
    most = std::max(most, glm::distance(projection_.pixel(nearest.position), projection_.pixel(sample.place)));
  }
  return most;
}

Result<std::vector<ViewBesidePeer>> measure_views_beside_peer(const std::shared_ptr<const OpenAsset>& asset,
                                                              const TriangleMesh& full, const View& view,
                                                              const std::vector<double>& tolerances_px,
                                                              std::size_t samples) {
  const PictureError error(full, view, samples);
  PeerLevels levels(full, asset->asset_head()->grid, error);
  std::vector<ViewBesidePeer> result;
  for (const double tolerance_px : tolerances_px) {
    Result<ViewBesidePeer> ours = deliver(asset, view, tolerance_px, error);
    if (!ours) return tl::unexpected(ours.error());
    const Result<ViewPeer> peer = levels.within(tolerance_px, view);
    if (!peer) return tl::unexpected(with_context(peer.error(), "meshoptimizer's level"));
    ours->peer = *peer;
    result.push_back(*ours);
  }
  return result;
}

}  // namespace fanstream::bench
