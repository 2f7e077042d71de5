// Line plots as pictures: curves over two axes, with ticks, grid and legend.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/render/image.h"

namespace fanstream {

// Points in drawing order. NaN in either coordinate interrupts the line; what lies outside the axes is drawn on their
// ends (so 0 and infinity have a place on a logarithmic axis).
struct PlotSeries {
  std::string name;
  std::vector<glm::dvec2> points;
  bool stepped = false;  // a value holds until the next point: horizontal, then vertical
  bool dashed = false;
  std::optional<std::array<std::uint8_t, 3>> color{};  // else one of six, by place in the list
};

struct PlotAxis {
  std::string label;  // with its unit: "bytes received"
  bool logarithmic = false;
  // Where the axis begins and ends. Left out: around the finite (on a logarithmic axis, positive) values of all series,
  // rounded outwards to ticks, a linear one from 0 if no value is negative.
  std::optional<double> low{}, high{};
};

struct PlotOptions {
  std::string title{};
  PlotAxis x, y;
  std::uint32_t width = 960;
  std::uint32_t height = 600;
  double text_height_px = 17.0;
};

// Fails (usage) for a size outside 200x150 to 8192x8192, no series or more than 32, a million points or more in all, an
// axis that does not rise, a logarithmic one that begins at 0 or below, and ends that are not finite. Series may be
// empty.
Result<Image> draw_plot(const std::vector<PlotSeries>& series, const PlotOptions& options);

// Ticks for an axis over [low, high]: where, and what stands there ("0", "0.5", "20k", "1M"; empty for marks between).
// Exposed for tests. Preconditions: low < high, both finite, low > 0 if logarithmic.
struct PlotTick {
  double value = 0.0;
  std::string label{};
};
std::vector<PlotTick> plot_ticks(double low, double high, bool logarithmic, std::size_t most_labels);

}  // namespace fanstream
