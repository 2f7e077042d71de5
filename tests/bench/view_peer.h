// What a picture is off, measured, and what one level of detail takes that is off no more: the peer of a view's bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "client/view/criteria.h"
#include "common/geometry/spread_points.h"
#include "tests/bench/open_asset.h"
#include "tests/support/projection.h"

namespace fanstream::bench {

// Points spread over a full model, of which those count that face the eye and lie in the picture, whatever hides them.
class PictureError {
 public:
  PictureError(const TriangleMesh& full, const View& view, std::size_t samples);

  // How far a point at most appears from its place where `shown` is drawn for the model, in px: at the point of `shown`
  // that is nearest to it in space. Measured at samples: a lower bound of what a client may state.
  // 0 if no sample counts. Fails as TriangleTree::build does.
  Result<double> of(const TriangleMesh& shown) const;
  std::size_t sample_count() const { return samples_.size(); }

 private:
  testing::Projection projection_;
  std::vector<SpreadPoint> samples_;
};

// The coarsest level of meshoptimizer's (from the full model on its grid, to a thousandth of its triangles) that is
// measured to be off by no more than a tolerance, coded by Draco 10 on that grid.
struct ViewPeer {
  double error_px = 0.0;
  std::uint32_t triangles = 0;
  std::size_t bytes = 0;
  std::size_t facing_bytes = 0;  // of those of its triangles alone that face the eye
};

struct ViewBesidePeer {
  double tolerance_px = 0.0;
  std::size_t bytes = 0;     // ours, head and index with it, until that is stated
  double stated_px = 0.0;    // then
  double measured_px = 0.0;  // of what is drawn then
  ViewPeer peer;
};

// `full` is the asset's full model. Ours with plain_criteria(), each tolerance from nothing.
Result<std::vector<ViewBesidePeer>> measure_views_beside_peer(const std::shared_ptr<const OpenAsset>& asset,
                                                              const TriangleMesh& full, const View& view,
                                                              const std::vector<double>& tolerances_px,
                                                              std::size_t samples);

}  // namespace fanstream::bench
