#include "client/session/session_record.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fanstream {
namespace {

// A running mean and the largest of one kind of time.
void add_time(double ms, double& mean, double& worst, double share) {
  mean += ms * share;
  worst = std::max(worst, ms);
}

void add_to_shot(Shot& shot, const FrameRecord& frame, const FrameRecord& base) {
  shot.end_error_px = frame.error_px.value_or(std::numeric_limits<double>::infinity());
  shot.stale_bytes = frame.stale_bytes - base.stale_bytes;
  if (!frame.error_px) return;
  for (std::size_t i = 0; i < kErrorSteps.size(); ++i) {
    if (shot.reached[i] || !(*frame.error_px <= kErrorSteps[i])) continue;
    shot.reached[i] = Reached{frame.time_s - shot.start_s, frame.received_bytes - base.received_bytes};
  }
}

}  // namespace

std::string_view name(ViewState state) {
  switch (state) {
    case ViewState::progressing: return "progressing";
    case ViewState::complete: return "complete";
    case ViewState::degraded: return "degraded";
  }
  return "";
}

namespace {

void add_smoothing(std::span<const FrameRecord> frames, SessionSummary& summary) {
  std::size_t smoothed = 0;
  for (const FrameRecord& frame : frames) {
    if (!frame.smoothing) continue;
    summary.smooth_faces_most = std::max(summary.smooth_faces_most, frame.smoothing->faces_after);
    summary.smooth_ms_mean += frame.smoothing->smooth_ms;
    summary.smooth_ms_worst = std::max(summary.smooth_ms_worst.value_or(0.0), frame.smoothing->smooth_ms);
    smoothed += frame.smoothing->smooth_ms > 0.0 ? 1 : 0;
  }
  if (smoothed > 0) summary.smooth_ms_mean /= static_cast<double>(smoothed);
}

}  // namespace

SessionSummary summarise(std::span<const FrameRecord> frames, const std::optional<PeerDownload>& draco,
                         const std::optional<FirstImage>& first_image) {
  SessionSummary summary;
  summary.draco = draco;
  summary.frames = static_cast<std::uint32_t>(frames.size());
  if (first_image) {
    summary.first_image_s = first_image->time_s;
    summary.first_image_bytes = first_image->received_bytes;
  }
  const double share = frames.empty() ? 0.0 : 1.0 / static_cast<double>(frames.size());
  std::size_t drawn = 0;
  double least_psnr = std::numeric_limits<double>::infinity();
  bool measured = false;
  FrameRecord base;  // as the counts were when the shot began: after a cut those of the frame before it
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const FrameRecord& frame = frames[i];
    if (i == 0 || frame.cut) {
      if (i > 0) base = frames[i - 1];
      summary.shots.push_back({frame.frame, i == 0 ? 0.0 : frame.time_s, {}, 0, 0.0});
    }
    add_to_shot(summary.shots.back(), frame, base);
    if (!summary.first_image_s && frame.triangles > 0) {
      summary.first_image_s = frame.time_s;
      summary.first_image_bytes = frame.received_bytes;
    }
    summary.splits_applied += frame.splits_applied;
    summary.splits_undone += frame.splits_undone;
    add_time(frame.plan_ms, summary.plan_ms_mean, summary.plan_ms_worst, share);
    add_time(frame.apply_ms, summary.apply_ms_mean, summary.apply_ms_worst, share);
    add_time(frame.draw_ms, summary.draw_ms_mean, summary.draw_ms_worst, 1.0);
    drawn += frame.draw_ms > 0.0 ? 1 : 0;
    if (frame.difference && frame.triangles > 0) {
      measured = true;
      least_psnr = std::min(least_psnr, frame.difference->psnr_db);
    }
    if (frame.state == ViewState::degraded) {
      ++summary.degraded_frames;
      summary.degraded_reason = frame.reason;
    }
  }
  if (drawn > 0) summary.draw_ms_mean /= static_cast<double>(drawn);
  if (measured) summary.psnr_db_least = least_psnr;
  add_smoothing(frames, summary);
  if (!frames.empty()) {
    const FrameRecord& last = frames.back();
    summary.duration_s = last.time_s;
    summary.received_bytes = last.received_bytes;
    summary.segment_bytes = last.segment_bytes;
    summary.segments = last.segments;
    summary.stale_bytes = last.stale_bytes;
    summary.end_state = last.state;
  }
  return summary;
}

}  // namespace fanstream
