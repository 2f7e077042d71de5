#include "tests/bench/view_bytes.h"

#include <optional>

#include "client/view/camera.h"

namespace fanstream::bench {

View whole_view(const std::vector<glm::dvec3>& points) {
  View view;
  FitOptions options;
  options.aspect = static_cast<double>(view.width_px) / view.height_px;
  options.margin = 0.02;
  view.camera = fit(points, options);
  view.near_distance = depth_range(view.camera, bounds_of(points)).near_distance;
  return view;
}

Criteria plain_criteria() {
  Criteria criteria;
  criteria.silhouette_weight = 1.0;
  criteria.back_facing_weight = 0.0;
  criteria.frustum_falloff = 0.0;
  return criteria;
}

PlanOptions everything_wanted() {
  PlanOptions options;
  options.criteria.use_frustum = options.criteria.use_facing = false;
  options.tolerance_px = 0.0;
  return options;
}

Result<ViewDelivery> ViewDelivery::start(std::shared_ptr<const OpenAsset> asset, Tables tables) {
  ViewDelivery delivery;
  std::shared_ptr<const AssetHead> head = asset->asset_head();
  std::optional<AssetIndex> index;
  if (tables == Tables::own || head->has_pages) {
    Result<AssetHead> own_head = read_head(asset->head(), "the asset");
    if (!own_head) return tl::unexpected(own_head.error());
    head = std::make_shared<const AssetHead>(std::move(*own_head));
    Result<AssetIndex> own_index = read_index(asset->index(), asset->preamble(), *head, "the asset");
    if (!own_index) return tl::unexpected(own_index.error());
    index = std::move(*own_index);
  } else {
    index = *asset->asset_index();
  }
  delivery.asset_ = std::move(asset);
  delivery.model_ = std::make_unique<ViewModel>(std::move(head));
  delivery.handed_over_.assign(delivery.asset_->cell_count(), 0);
  if (Result<void> set = delivery.model_->set_index(std::move(*index), "the asset"); !set) {
    return tl::unexpected(set.error());
  }
  return delivery;
}

// What a new slab reveals may change the plan, so once is not enough.
Result<const Plan*> ViewDelivery::settle(const View& view, const PlanOptions& options) {
  constexpr int kMostRounds = 1000;
  for (int round = 0; round < kMostRounds; ++round) {
    const Plan& plan = model_->plan(view, options);
    if (plan.limitation != Limitation::none)
      return fail(ErrorKind::bad_input, "the view is not served: " + plan.reason);
    const MeshMove move = model_->apply();
    if (!move.damage.empty()) return tl::unexpected(move.damage.front().error);
    if (move.applied + move.undone == 0) return &plan;
  }
  return fail(ErrorKind::bad_input, "the mesh does not come to rest");
}

Result<void> ViewDelivery::hand_over(std::span<const Want> wants) {
  std::uint64_t batch = 0;
  for (const Want& want : wants) {
    std::uint32_t& next = handed_over_[want.cell];
    for (; next < want.prefix; ++next) {
      const std::span<const std::byte> bytes = asset_->segment(want.cell, next);
      if (bytes.empty()) continue;
      if (Result<void> added = model_->add_segment(want.cell, next, bytes); !added) return added;
      batch += bytes.size();
      ++segments_;
    }
    if (batch >= kBatchBytes) break;
  }
  segment_bytes_ += batch;
  if (batch == 0) return fail(ErrorKind::bad_input, "the planner wants only what it has");
  return {};
}

Result<ViewBytes> ViewDelivery::deliver(const View& view, const PlanOptions& options, StopAt stop) {
  for (;;) {
    const Result<const Plan*> plan = settle(view, options);
    if (!plan) return tl::unexpected(plan.error());
    const Plan& p = **plan;
    const bool reached = p.stated_error_px <= options.tolerance_px;
    if (p.wants.empty() && stop == StopAt::stated_error && !reached) {
      return fail(ErrorKind::bad_input,
                  "nothing more is wanted at a stated error of " + std::to_string(p.stated_error_px) + " px");
    }
    if (stop == StopAt::stated_error ? reached : p.wants.empty()) {
      return ViewBytes{options.tolerance_px, segment_bytes_, segments_, p.triangles, p.stated_error_px};
    }
    if (Result<void> handed = hand_over(p.wants); !handed) return tl::unexpected(handed.error());
  }
}

}  // namespace fanstream::bench
