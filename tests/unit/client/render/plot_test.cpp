#include "client/render/plot.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace fanstream {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::array<std::uint8_t, 3> kRed{255, 0, 0};

PlotSeries red(std::vector<glm::dvec2> points) { return {"red", std::move(points), false, false, kRed}; }

PlotOptions framed(bool log_x, bool log_y, glm::dvec2 low, glm::dvec2 high) {
  PlotOptions options;
  options.x = {"x", log_x, low.x, high.x};
  options.y = {"y", log_y, low.y, high.y};
  options.width = 640;
  options.height = 480;
  return options;
}

bool is_red(const Image& image, std::uint32_t x, std::uint32_t y) {
  const std::uint8_t* p = image.pixel(x, y);
  return p[0] > 200 && p[1] < 90 && p[2] < 90;
}

// The mean row of the curve in each column, NaN where there is none; the legend is left out.
std::vector<double> rows_of(const Image& image) {
  std::vector<double> rows(image.width, std::nan(""));
  for (std::uint32_t x = 0; x < image.width; ++x) {
    double sum = 0.0;
    int count = 0;
    for (std::uint32_t y = 42; y < image.height; ++y) {
      if (!is_red(image, x, y)) continue;
      sum += y;
      ++count;
    }
    if (count > 0) rows[x] = sum / count;
  }
  return rows;
}

std::pair<std::size_t, std::size_t> extent(const std::vector<double>& rows) {
  std::size_t first = 0;
  while (first < rows.size() && std::isnan(rows[first])) ++first;
  std::size_t last = rows.size();
  while (last > first && std::isnan(rows[last - 1])) --last;
  return {first, last - 1};
}

void expect_straight(const std::vector<double>& rows) {
  const auto [first, last] = extent(rows);
  ASSERT_GT(last, first + 300);
  for (std::size_t x = first + 4; x <= last - 4; ++x) {
    const double share = static_cast<double>(x - first) / static_cast<double>(last - first);
    EXPECT_NEAR(rows[x], rows[first + 2] + share * (rows[last - 2] - rows[first + 2]), 3.0) << "column " << x;
  }
}

TEST(Plot, ProportionIsAStraightLineOnEqualAxes) {
  for (const bool logarithmic : {false, true}) {
    std::vector<glm::dvec2> points;
    for (double v = 1.0; v <= 1000.0; v *= 1.2) points.emplace_back(v, 2.0 * v);
    const Result<Image> image = draw_plot({red(points)}, framed(logarithmic, logarithmic, {1, 1}, {1000, 2000}));
    ASSERT_TRUE(image) << image.error().message;
    const std::vector<double> rows = rows_of(*image);
    const auto [first, last] = extent(rows);
    EXPECT_GT(rows[first + 2], rows[last - 2] + 150) << "more is not higher up";
    expect_straight(rows);
  }
}

TEST(Plot, StepsHoldTheirValue) {
  PlotSeries steps = red({{0, 8}, {5, 2}, {10, 2}});
  steps.stepped = true;
  const std::vector<double> rows = rows_of(draw_plot({steps}, framed(false, false, {0, 0}, {10, 10})).value());
  const auto [first, last] = extent(rows);
  const std::size_t middle = (first + last) / 2;
  EXPECT_NEAR(rows[first + 2], rows[middle - 5], 0.6);
  EXPECT_NEAR(rows[last - 2], rows[middle + 5], 0.6);
  EXPECT_GT(rows[last - 2], rows[first + 2] + 100);
}

// Zero on a logarithmic axis and infinity on any: at the ends, where they are seen.
TEST(Plot, WhatIsOutsideIsDrawnOnTheEdge) {
  const PlotOptions options = framed(false, true, {0, 1}, {10, 100});
  const std::vector<double> zero = rows_of(draw_plot({red({{0, 0}, {10, 0}})}, options).value());
  const std::vector<double> one = rows_of(draw_plot({red({{0, 1}, {10, 1}})}, options).value());
  EXPECT_EQ(zero[300], one[300]);
  const std::vector<double> infinite = rows_of(draw_plot({red({{0, kInfinity}, {10, kInfinity}})}, options).value());
  const std::vector<double> hundred = rows_of(draw_plot({red({{0, 100}, {10, 100}})}, options).value());
  EXPECT_EQ(infinite[300], hundred[300]);
  EXPECT_LT(infinite[300], zero[300] - 200);
}

TEST(Plot, NanInterruptsTheLineAndDashesAreGaps) {
  const PlotOptions options = framed(false, false, {0, 0}, {10, 10});
  const double nan = std::nan("");
  const std::vector<double> broken =
      rows_of(draw_plot({red({{0, 5}, {4, 5}, {nan, nan}, {6, 5}, {10, 5}})}, options).value());
  const auto [first, last] = extent(broken);
  EXPECT_TRUE(std::isnan(broken[(first + last) / 2]));
  EXPECT_FALSE(std::isnan(broken[first + (last - first) / 4]));
  PlotSeries dashed = red({{0, 5}, {10, 5}});
  dashed.dashed = true;
  int gaps = 0;
  const std::vector<double> rows = rows_of(draw_plot({dashed}, options).value());
  for (std::size_t x = first; x < last; ++x) gaps += !std::isnan(rows[x]) && std::isnan(rows[x + 1]) ? 1 : 0;
  EXPECT_GT(gaps, 20);
}

TEST(Plot, AxesFindTheirEnds) {
  PlotOptions options;
  options.x.label = "x";
  options.y = {"y", true, {}, {}};
  const Result<Image> image = draw_plot({red({{3, 0.0}, {97, 0.02}, {50, 700.0}, {60, kInfinity}})}, options);
  ASSERT_TRUE(image) << image.error().message;
  // Also where there is nothing to go by.
  EXPECT_TRUE(draw_plot({red({})}, options));
  EXPECT_TRUE(draw_plot({red({{5, 5}})}, options));
  EXPECT_TRUE(draw_plot({red({{-5, 1e300}, {1e300, 5e-324}})}, options));
  EXPECT_TRUE(draw_plot({red({{0, 0}, {0, 0}})}, options));
}

TEST(Plot, RefusesWhatCannotBeDrawn) {
  const auto refused = [](const std::vector<PlotSeries>& series, const PlotOptions& options) {
    const Result<Image> image = draw_plot(series, options);
    return !image && image.error().kind == ErrorKind::usage;
  };
  PlotOptions options = framed(false, false, {0, 0}, {1, 1});
  EXPECT_TRUE(refused({}, options));
  EXPECT_TRUE(refused(std::vector<PlotSeries>(33), options));
  EXPECT_TRUE(refused({red(std::vector<glm::dvec2>(1'000'000))}, options));
  EXPECT_TRUE(refused({red({})}, framed(false, false, {1, 0}, {1, 1})));
  EXPECT_TRUE(refused({red({})}, framed(false, true, {0, 0}, {1, 1})));
  EXPECT_TRUE(refused({red({})}, framed(false, false, {0, 0}, {kInfinity, 1})));
  options.width = 199;
  EXPECT_TRUE(refused({red({})}, options));
}

std::vector<std::string> labels(double low, double high, bool logarithmic, std::size_t most) {
  std::vector<std::string> result;
  for (const PlotTick& tick : plot_ticks(low, high, logarithmic, most)) {
    if (!tick.label.empty()) result.push_back(tick.label);
  }
  return result;
}

using Labels = std::vector<std::string>;

TEST(PlotTicks, AreRoundNumbersInsideTheAxis) {
  EXPECT_EQ(labels(0, 10, false, 6), (Labels{"0", "2", "4", "6", "8", "10"}));
  EXPECT_EQ(labels(0, 1.2e6, false, 6), (Labels{"0", "200k", "400k", "600k", "800k", "1M", "1.2M"}));
  EXPECT_EQ(labels(-0.3, 0.3, false, 6), (Labels{"-0.3", "-0.2", "-0.1", "0", "0.1", "0.2", "0.3"}));
  EXPECT_EQ(labels(0.1, 1000, true, 10), (Labels{"0.1", "1", "10", "100", "1k"}));
  EXPECT_EQ(labels(1, 100, true, 12), (Labels{"1", "2", "5", "10", "20", "50", "100"}));
  EXPECT_EQ(labels(1, 1e12, true, 6), (Labels{"1", "100", "10k", "1M", "100M", "10G", "1T"}));
  EXPECT_EQ(labels(3, 4, true, 5), (Labels{"3", "3.2", "3.4", "3.6", "3.8", "4"}));
  for (const bool logarithmic : {false, true}) {
    for (const auto& [low, high] : {std::pair{1e-9, 1e9}, {0.07, 0.9}, {123.4, 567.8}, {1e300, 1e305}}) {
      const std::vector<PlotTick> ticks = plot_ticks(low, high, logarithmic, 7);
      ASSERT_FALSE(ticks.empty());
      EXPECT_LT(ticks.size(), 200U);
      EXPECT_GE(ticks.front().value, low - (high - low) * 1e-6);
      EXPECT_LE(ticks.back().value, high + (high - low) * 1e-6);
    }
  }
}

}  // namespace
}  // namespace fanstream
