#include "client/session/session_plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace fanstream {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLowestErrorPx = 0.1;
constexpr double kHighestErrorPx = 1000.0;

// Frames without a mesh are beyond any error. `x` of a frame is where it stands on the horizontal axis.
template <class Place>
std::vector<PlotSeries> curves(std::span<const FrameRecord> frames, Place&& x, const std::string& draco_name,
                               std::optional<double> draco_at) {
  PlotSeries ours{"Fanstream", {}, true, false, {}};
  PlotSeries wanted{"tolerance", {}, true, true, std::array<std::uint8_t, 3>{120, 125, 134}};
  for (const FrameRecord& frame : frames) {
    ours.points.emplace_back(x(frame), frame.error_px.value_or(kInfinity));
    if (wanted.points.empty() || wanted.points.back().y != frame.wanted_tolerance_px) {
      wanted.points.emplace_back(x(frame), frame.wanted_tolerance_px);
    }
  }
  // A little further than the last thing that happens, so that it is seen.
  const double end = 1.03 * std::max(x(frames.back()), draco_at.value_or(0.0));
  wanted.points.emplace_back(end, wanted.points.back().y);
  std::vector<PlotSeries> all{std::move(ours)};
  if (draco_at) {
    all.push_back(
        {draco_name, {{0.0, kInfinity}, {*draco_at, kInfinity}, {*draco_at, 0.0}, {end, 0.0}}, false, false, {}});
  }
  all.push_back(std::move(wanted));
  return all;
}

// Decades around what is stated, the tolerance seen as well.
PlotAxis error_axis(std::span<const FrameRecord> frames) {
  PlotAxis axis{"stated error, px (top: nothing shown, bottom: exact)", true, 1.0, 10.0};
  const auto include = [&axis](double error_px) {
    while (error_px < *axis.low * 0.999 && *axis.low > kLowestErrorPx * 1.001) *axis.low /= 10.0;
    while (error_px > *axis.high * 1.001 && *axis.high < kHighestErrorPx * 0.999) *axis.high *= 10.0;
  };
  for (const FrameRecord& frame : frames) {
    include(frame.wanted_tolerance_px / 2.0);
    if (frame.error_px) include(*frame.error_px);
  }
  return axis;
}

Result<Image> plot(const std::string& title, std::span<const FrameRecord> frames, const std::string& x_label,
                   const std::vector<PlotSeries>& series) {
  PlotOptions options;
  options.title = title;
  options.x.label = x_label;
  const double end = series.back().points.back().x;  // the tolerance runs all along
  if (end > 0.0 && std::isfinite(end)) options.x = {x_label, false, 0.0, end};
  options.y = error_axis(frames);
  return draw_plot(series, options);
}

}  // namespace

Result<Image> plot_error_by_bytes(const std::string& title, std::span<const FrameRecord> frames,
                                  const std::optional<PeerDownload>& draco) {
  if (frames.empty()) return fail(ErrorKind::usage, "plot: no frames");
  std::optional<double> at;
  if (draco) at = static_cast<double>(draco->size_bytes);
  const auto bytes = [](const FrameRecord& frame) { return static_cast<double>(frame.received_bytes); };
  return plot(title, frames, "bytes received", curves(frames, bytes, "Draco, whole file", at));
}

Result<Image> plot_error_by_time(const std::string& title, std::span<const FrameRecord> frames,
                                 const std::optional<PeerDownload>& draco) {
  if (frames.empty()) return fail(ErrorKind::usage, "plot: no frames");
  std::optional<double> at;
  if (draco) at = draco->picture_s();
  const auto time = [](const FrameRecord& frame) { return frame.time_s; };
  return plot(title, frames, "seconds", curves(frames, time, "Draco, decoded", at));
}

}  // namespace fanstream
