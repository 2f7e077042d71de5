#include "client/session/live_session.h"

#include <chrono>
#include <cmath>

#include "client/session/damaged_segments.h"
#include "client/session/view_model.h"
#include "client/smooth/finest_need.h"
#include "common/fans/fan_shape.h"

namespace fanstream {
namespace {

// Runs a piece of work and adds up how long it took.
template <class Work>
auto timed(double& sum_ms, Work&& work) {
  const auto begun = std::chrono::steady_clock::now();
  struct Stop {
    std::chrono::steady_clock::time_point begun;
    double& sum_ms;
    ~Stop() { sum_ms += std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begun).count(); }
  } stop{begun, sum_ms};
  return work();
}

class LiveSession final : public ViewSession {
 public:
  LiveSession(std::unique_ptr<SessionTransport> transport, const SessionSettings& settings)
      : transport_(std::move(transport)) {
    view_.width_px = settings.width;
    view_.height_px = settings.height;
    if (settings.triangle_budget) options_.max_triangles = *settings.triangle_budget;
    if (settings.smooth) smoother_.emplace(*settings.smooth);
    if (settings.memory_budget_bytes) options_.max_memory_bytes = *settings.memory_budget_bytes;
  }

  Result<SessionStep> step(const PathView& view, double time_s) override {
    if (!has_looked_) look_at(view);
    has_looked_ = true;
    step_ = {};
    Result<void> ran = transport_->run_until(
        time_s, [this](const TransportEvent& event, double now_s) { return handle(event, now_s); });
    if (!ran) return tl::unexpected(with_context(ran.error(), transport_->name()));
    look_at(view);  // which nobody knew before
    if (can_plan()) {
      if (Result<void> asked = plan_and_ask(); !asked) return tl::unexpected(asked.error());
    }
    return report();
  }

  double now_s() const override { return transport_->now_s(); }
  std::optional<FirstImage> first_image() const override { return first_image_; }

  Result<FanMesh> fan_mesh() override {
    if (!model_) return FanMesh{};
    if (!smoother_) return make_fan_mesh(model_->mesh().triangle_mesh());
    Result<SmoothedMesh> smoothed = smoother_->smooth(model_->mesh(), view_);
    if (!smoothed) return tl::unexpected(with_context(smoothed.error(), transport_->name()));
    smoothing_ = std::move(smoothed->report);
    return make_fan_mesh(smoothed->mesh);
  }
  bool mesh_follows_camera() const override { return smoother_.has_value(); }
  std::optional<SmoothReport> smoothing() const override { return smoothing_; }

 private:
  bool can_plan() const { return model_ && model_->has_index(); }

  void look_at(const PathView& view) {
    view_.camera = view.camera;
    if (model_) view_.near_distance = depth_range(view.camera, bounds_).near_distance;
    wanted_tolerance_px_ = options_.tolerance_px = view.tolerance_px;
    options_.criteria.focus_point.reset();
    if (view.focus) {
      FocusPoint focus;
      focus.position = view.focus->center;
      focus.radius = view.focus->radius;
      options_.criteria.focus_point = focus;
    }
  }

  Result<void> handle(const TransportEvent& event, double now_s) {
    if (const auto* head = std::get_if<event::HeadArrived>(&event)) return take_head(head->bytes, now_s);
    if (const auto* index = std::get_if<event::IndexArrived>(&event)) return take_index(index->bytes);
    if (const auto* piece = std::get_if<event::PieceArrived>(&event)) {
      const bool wanted = piece->cell < wanted_.size() && piece->segment < wanted_[piece->cell];
      if (!wanted) stale_bytes_ += piece->bytes.size();
      segment_bytes_ += piece->bytes.size();
      ++segments_;
      if (Result<void> added = model_->add_segment(piece->cell, piece->segment, piece->bytes); !added) return added;
      const AssetIndex& index = model_->mesh().index();
      if (index.is_page(piece->cell, piece->segment)) transport_->learn_children(index, piece->cell);
      return {};
    }
    if (const auto* hindered = std::get_if<event::Hindered>(&event)) hindrance_ = hindered->reason;
    // Cells that have come to be may ask for more; no need to wait for the next frame.
    return std::holds_alternative<event::ListServed>(event) ? plan_and_ask() : Result<void>{};
  }

  Result<void> take_head(std::span<const std::byte> bytes, double now_s) {
    Result<AssetPreamble> preamble = read_preamble(bytes, "the head");
    if (!preamble) return tl::unexpected(preamble.error());
    preamble_ = *preamble;
    Result<AssetHead> head = read_head(bytes, "the head");
    if (!head) return tl::unexpected(head.error());
    head_ = std::make_shared<const AssetHead>(std::move(*head));
    model_ = std::make_unique<ViewModel>(head_);
    bounds_ = head_->grid.bounds();  // FM0 may end short of what comes: the near plane would lie behind it
    view_.near_distance = depth_range(view_.camera, bounds_).near_distance;
    first_image_ = FirstImage{now_s, transport_->received_bytes()};
    return {};
  }

  Result<void> take_index(std::span<const std::byte> bytes) {
    Result<AssetIndex> index = read_index(bytes, preamble_, *head_, "the index");
    if (!index) return tl::unexpected(index.error());
    if (Result<void> used = transport_->use_index(*index); !used) return used;
    if (Result<void> set = model_->set_index(std::move(*index), "the index"); !set) return set;
    const AssetIndex& kept = model_->mesh().index();
    wanted_.assign(kept.cells.size() + 1, 0);  // with the polygons' own
    model_->want_polygons(smoother_.has_value());
    if (smoother_) finest_need_.emplace(*head_, kept);
    return plan_and_ask();
  }

  // Plans, goes towards the plan with what is held, looks again at how things stand then, and asks for what is missing.
  Result<void> plan_and_ask() {
    if (finest_need_) {
      const bool finest = finest_need_->decide(view_, options_.criteria, model_->table(), model_->mesh());
      options_.tolerance_px = finest ? 0.0 : wanted_tolerance_px_;
    }
    timed(step_.plan_ms, [&] { model_->plan(view_, options_); });
    constexpr int kMostRounds = 8;  // cells that come to be may have their segments already
    for (int round = 0; round < kMostRounds; ++round) {
      const MeshMove move = timed(step_.apply_ms, [&] { return model_->apply(); });
      step_.splits_applied += move.applied;
      step_.splits_undone += move.undone;
      for (const MeshMove::Damage& damage : move.damage) damage_.add(damage);
      if (round > 0 && move.applied + move.undone == 0) break;
      timed(step_.plan_ms, [&] { model_->plan(view_, options_); });
    }
    if (const std::vector<CellRun> released = model_->evict(); !released.empty()) {
      damage_.forget(released);
      if (Result<void> told = transport_->release(released); !told) return told;
    }
    std::vector<CellRun> wants = model_->wants();
    if (wants == asked_) return {};
    asked_ = wants;
    std::fill(wanted_.begin(), wanted_.end(), 0U);
    for (const Want& want : model_->current_plan().wants) {
      wanted_[want.cell] = std::max(wanted_[want.cell], want.prefix);
    }
    if (model_->wants_polygons()) wanted_.back() = 1;
    return transport_->want(std::move(wants));
  }

  SessionStep report() {
    step_.time_s = transport_->now_s();
    step_.received_bytes = transport_->received_bytes();
    step_.segment_bytes = segment_bytes_;
    step_.segments = segments_;
    step_.stale_bytes = stale_bytes_;
    step_.tolerance_px = options_.tolerance_px;
    if (!model_) return step_;
    step_.triangles = 2ULL * (model_->mesh().vertex_count() - head_->base.places.size()) + head_->base.triangles.size();
    if (!model_->has_index()) return step_;
    const Plan& plan = model_->current_plan();
    if (std::isfinite(plan.stated_error_px)) step_.error_px = plan.stated_error_px;
    step_.tolerance_px = plan.effective_tolerance_px;
    if (!damage_.empty() || plan.limitation != Limitation::none) {
      step_.state = ViewState::degraded;
      step_.reason = damage_.empty() ? plan.reason : damage_.reason();
    } else if (plan.settled) {
      step_.state = ViewState::complete;
    } else if (!hindrance_.empty()) {
      step_.state = ViewState::degraded;
      step_.reason = hindrance_;
    }
    return step_;
  }

  std::unique_ptr<SessionTransport> transport_;
  View view_;
  bool has_looked_ = false;
  PlanOptions options_;
  AssetPreamble preamble_;
  std::shared_ptr<const AssetHead> head_;
  std::unique_ptr<ViewModel> model_;
  Bounds bounds_;
  SessionStep step_;
  std::optional<FirstImage> first_image_;
  std::optional<SilhouetteSmoother> smoother_;
  std::optional<SmoothReport> smoothing_;  // of the last mesh
  std::optional<FinestNeed> finest_need_;  // with smoother_ and the index
  double wanted_tolerance_px_ = 1.0;       // of the path
  std::vector<CellRun> asked_;
  std::vector<std::uint32_t> wanted_;  // by cell: the prefix of the newest list
  std::uint64_t segment_bytes_ = 0, segments_ = 0, stale_bytes_ = 0;
  std::string hindrance_;
  DamagedSegments damage_;
};

}  // namespace

std::unique_ptr<ViewSession> live_session(std::unique_ptr<SessionTransport> transport,
                                          const SessionSettings& settings) {
  return std::make_unique<LiveSession>(std::move(transport), settings);
}

}  // namespace fanstream
