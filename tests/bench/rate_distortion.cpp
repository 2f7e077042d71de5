#include "tests/bench/rate_distortion.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "common/geometry/mesh_distance.h"
#include "tests/bench/peer_level.h"

namespace fanstream::bench {

namespace {

struct SegmentId {
  std::uint32_t cell = 0;
  std::uint32_t segment = 0;
  std::uint32_t layer = 0;
  std::uint8_t error_code = 0;
};

std::vector<SegmentId> by_layer(const OpenAsset& asset) {
  std::vector<SegmentId> order;
  const AssetIndex& index = *asset.asset_index();
  for (std::uint32_t c = 0; c < asset.cell_count(); ++c) {
    const CellEntry& cell = index.cells[c];
    for (std::uint32_t s = 0; s < cell.segment_count; ++s) {
      order.push_back(
          {c, s, asset.asset_head()->layer_begin(cell.slab) + s, index.segments[cell.first_segment + s].error_code});
    }
  }
  std::stable_sort(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.layer < b.layer; });
  return order;
}

// As for a tolerance that falls everywhere at once. Bounds never rise from coarse to fine, so what a segment needs of
// its own cell and parent stands before it.
std::vector<SegmentId> by_bound(std::vector<SegmentId> order) {
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.error_code > b.error_code; });
  return order;
}

class Curve {
 public:
  static Result<Curve> of(const std::shared_ptr<const OpenAsset>& asset, std::size_t face_samples) {
    Curve curve(asset, face_samples);
    const std::vector<SegmentId> order = by_layer(*asset);
    Result<TriangleMesh> full = curve.mesh_of(order);
    if (!full) return tl::unexpected(full.error());
    if (full->positions.size() != asset->vertex_count()) {
      return fail(ErrorKind::bad_input, "all segments do not make the whole model");
    }
    curve.full_ = std::move(*full);
    Result<TriangleTree> tree = TriangleTree::build(curve.full_);
    if (!tree) return tl::unexpected(tree.error());
    curve.tree_ = std::make_shared<const TriangleTree>(std::move(*tree));
    return curve;
  }

  const TriangleMesh& full() const { return full_; }

  Result<double> rms_of(const TriangleMesh& level) const {
    const Result<MeshDistance> distance = mesh_distance(full_, *tree_, level, {face_samples_, 1});
    if (!distance) return tl::unexpected(distance.error());
    return distance->relative_rms();
  }

  Result<RatePoint> at(std::span<const SegmentId> segments) const {
    const Result<TriangleMesh> mesh = mesh_of(segments);
    if (!mesh) return tl::unexpected(mesh.error());
    const Result<double> rms = rms_of(*mesh);
    if (!rms) return tl::unexpected(rms.error());
    std::size_t bytes = asset_->head().size() + asset_->index().size();
    const AssetIndex& index = *asset_->asset_index();
    std::set<std::uint32_t> pages;  // of which parents
    for (const SegmentId& s : segments) {
      bytes += asset_->segment(s.cell, s.segment).size();
      if (s.cell >= index.first_paged) pages.insert(index.cells[s.cell].parent);
    }
    for (const std::uint32_t parent : pages) bytes += index.cells[parent].page_bytes;
    return RatePoint{static_cast<double>(bytes), *rms};
  }

 private:
  Curve(std::shared_ptr<const OpenAsset> asset, std::size_t face_samples)
      : asset_(std::move(asset)), face_samples_(face_samples) {}

  Result<TriangleMesh> mesh_of(std::span<const SegmentId> segments) const {
    ProgressiveMesh mesh(asset_->asset_head());
    mesh.set_index(asset_->asset_index());
    for (const SegmentId& s : segments) {
      if (Result<void> added = mesh.add_segment(s.cell, s.segment, asset_->segment(s.cell, s.segment)); !added) {
        return tl::unexpected(added.error());
      }
    }
    if (const Result<std::uint64_t> refined = mesh.refine(); !refined) return tl::unexpected(refined.error());
    return mesh.triangle_mesh();
  }

  std::shared_ptr<const OpenAsset> asset_;
  std::size_t face_samples_;
  TriangleMesh full_;
  std::shared_ptr<const TriangleTree> tree_;
};

Result<std::vector<RatePoint>> layer_points(const Curve& curve, std::span<const SegmentId> order) {
  std::vector<RatePoint> points;
  for (std::size_t i = 0; i <= order.size(); ++i) {
    const bool border = i == 0 || i == order.size() || order[i].layer != order[i - 1].layer;
    if (!border) continue;
    const Result<RatePoint> point = curve.at(order.first(i));
    if (!point) return tl::unexpected(point.error());
    points.push_back(*point);
  }
  return points;
}

Result<double> fewest_segments(const Curve& curve, std::span<const SegmentId> order, double rms) {
  const auto reaches = [&](std::size_t count) -> Result<bool> {
    const Result<RatePoint> point = curve.at(order.first(count));
    if (!point) return tl::unexpected(point.error());
    return point->rms <= rms;
  };
  const Result<std::size_t> count = first_that(0, order.size(), 1, reaches);
  if (!count) return tl::unexpected(count.error());
  const Result<RatePoint> point = curve.at(order.first(*count));
  if (!point) return tl::unexpected(point.error());
  return point->bytes;
}

Result<void> measure_peer(const Curve& curve, const PositionGrid& grid, RateAtRms& rate) {
  const auto is_good_enough = [&](std::size_t triangles) -> Result<bool> {
    const Result<TriangleMesh> level = peer_level(curve.full(), triangles, grid);
    if (!level) return tl::unexpected(level.error());
    const Result<double> rms = curve.rms_of(*level);
    if (!rms) return tl::unexpected(rms.error());
    return *rms <= rate.rms;
  };
  const Result<std::size_t> triangles = fewest_triangles(curve.full().triangles.size(), is_good_enough);
  if (!triangles) return tl::unexpected(triangles.error());
  const Result<TriangleMesh> level = peer_level(curve.full(), *triangles, grid);
  if (!level) return tl::unexpected(level.error());
  const Result<double> rms = curve.rms_of(*level);
  if (!rms) return tl::unexpected(rms.error());
  const Result<std::size_t> bytes = draco_bytes(*level, grid);
  if (!bytes) return tl::unexpected(bytes.error());
  rate.peer_bytes = *bytes;
  rate.peer_triangles = static_cast<std::uint32_t>(level->triangles.size());
  rate.peer_rms = *rms;
  return {};
}

}  // namespace

std::optional<double> bytes_at_rms(std::span<const RatePoint> curve, double rms) {
  for (std::size_t i = 0; i < curve.size(); ++i) {
    if (curve[i].rms > rms) continue;
    // The full model is off by nothing, which has no logarithm.
    if (i == 0 || curve[i].rms <= 0.0) return curve[i].bytes;
    const double part = std::log(rms / curve[i - 1].rms) / std::log(curve[i].rms / curve[i - 1].rms);
    return curve[i - 1].bytes * std::pow(curve[i].bytes / curve[i - 1].bytes, part);
  }
  return std::nullopt;
}

Result<RateCurve> measure_rates(const std::shared_ptr<const OpenAsset>& asset, std::span<const double> rms,
                                std::size_t face_samples) {
  const Result<Curve> curve = Curve::of(asset, face_samples);
  if (!curve) return tl::unexpected(curve.error());
  const std::vector<SegmentId> layers = by_layer(*asset);
  const std::vector<SegmentId> bounds = by_bound(layers);
  RateCurve result;
  Result<std::vector<RatePoint>> points = layer_points(*curve, layers);
  if (!points) return tl::unexpected(points.error());
  result.layers = std::move(*points);
  for (const double wanted : rms) {
    RateAtRms rate;
    rate.rms = wanted;
    rate.layers_bytes = bytes_at_rms(result.layers, wanted);
    const Result<double> segments = fewest_segments(*curve, bounds, wanted);
    if (!segments) return tl::unexpected(segments.error());
    rate.segments_bytes = *segments;
    if (Result<void> peer = measure_peer(*curve, asset->asset_head()->grid, rate); !peer) {
      return tl::unexpected(with_context(peer.error(), "meshoptimizer's level"));
    }
    result.at.push_back(rate);
  }
  return result;
}

}  // namespace fanstream::bench
