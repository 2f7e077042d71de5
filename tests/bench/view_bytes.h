// What a view costs: an asset's segments handed to a client's model in the order in which its planner wants them, in
// small batches and without a link in between, until the error that it states is low enough.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "client/session/view_model.h"
#include "tests/bench/open_asset.h"

namespace fanstream::bench {

enum class StopAt : std::uint8_t {
  stated_error,    // as soon as Plan::stated_error_px is at most the tolerance
  nothing_wanted,  // when all that the planner wants is there and applied
};

struct ViewBytes {
  double tolerance_px = 0.0;
  std::uint64_t segment_bytes = 0;  // of all that was handed over; head and index are not in it
  std::uint32_t segments = 0;       // that have bytes
  std::uint64_t triangles = 0;      // of the whole mesh at the end
  double stated_error_px = 0.0;     // at the end
};

// A client's model of an asset and its view, to be played with.
class ViewDelivery {
 public:
  enum class Tables : std::uint8_t {
    shared,  // head and index are the asset's
    own,     // they are read anew, as a client has to
  };
  // Fails as read_head, read_index and ViewModel::set_index do.
  static Result<ViewDelivery> start(std::shared_ptr<const OpenAsset> asset, Tables tables = Tables::shared);

  // Goes on from what is there. Segments come in batches that end with the one that makes them kBatchBytes or more;
  // after each the planner plans anew, and the mesh follows until it rests. Fails (bad_input) if the planner wants
  // nothing more while the stated error is still too large (stated_error), if a segment cannot be decoded, or if the
  // mesh does not come to rest.
  Result<ViewBytes> deliver(const View& view, const PlanOptions& options, StopAt stop);

  ViewModel& model() { return *model_; }

 private:
  static constexpr std::uint64_t kBatchBytes = 1024;
  ViewDelivery() = default;
  Result<const Plan*> settle(const View& view, const PlanOptions& options);
  Result<void> hand_over(std::span<const Want> wants);

  std::shared_ptr<const OpenAsset> asset_;
  std::unique_ptr<ViewModel> model_;
  std::vector<std::uint32_t> handed_over_;  // by cell: segments
  std::uint64_t segment_bytes_ = 0;
  std::uint32_t segments_ = 0;
};

// The view of `points` that fills a picture of 1024 x 768 but for 2 % on each side.
View whole_view(const std::vector<glm::dvec3>& points);

// Everything that is off by anything, wherever it is: the full model but for what has no error without.
PlanOptions everything_wanted();

// Weights that want exactly what the stated error needs: silhouettes count 1, back faces and what is outside the
// picture nothing.
Criteria plain_criteria();

}  // namespace fanstream::bench
