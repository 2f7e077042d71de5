#include "client/render/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

#include "client/render/text.h"

namespace fanstream {
namespace {

using Color = std::array<std::uint8_t, 3>;

constexpr std::array<std::uint8_t, 4> kPaper{255, 255, 255, 255};
constexpr Color kInk{28, 30, 34};
constexpr Color kPaleInk{86, 90, 98};
constexpr Color kGrid{226, 229, 234};
constexpr Color kPaleGrid{243, 244, 247};
constexpr Color kAxis{120, 125, 134};
// Told apart also by those who do not see red and green.
constexpr std::array<Color, 6> kColors{
    {{0, 107, 164}, {214, 84, 0}, {34, 139, 84}, {148, 80, 170}, {120, 100, 20}, {90, 90, 90}}};
constexpr double kLineWidth = 2.4;
constexpr double kDash = 10.0;
constexpr double kGap = 6.0;
constexpr double kLeastLogarithmic = 1e-150;
constexpr double kMostLogarithmic = 1e150;
constexpr std::size_t kMostSeries = 32;
constexpr std::size_t kMostPoints = 1'000'000;

void blend(Image& image, std::int64_t x, std::int64_t y, const Color& color, double alpha) {
  if (x < 0 || y < 0 || x >= image.width || y >= image.height) return;
  std::uint8_t* pixel = image.pixel(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y));
  for (std::size_t c = 0; c < 3; ++c) {
    pixel[c] = static_cast<std::uint8_t>(std::lround(pixel[c] + (color[c] - pixel[c]) * alpha));
  }
}

void fill_box(Image& image, double left, double top, double right, double bottom, const Color& color) {
  for (auto y = std::llround(top); y < std::llround(bottom); ++y) {
    for (auto x = std::llround(left); x < std::llround(right); ++x) blend(image, x, y, color, 1.0);
  }
}

// How much of each pixel a curve covers: kept apart from the picture, so that joints are not darker than the rest.
class Stroke {
 public:
  Stroke(const Image& image, bool dashed)
      : width_(image.width), height_(image.height), dashed_(dashed), cover_(std::size_t{width_} * height_) {}

  void line(const glm::dvec2& a, const glm::dvec2& b) {
    const double length = glm::length(b - a);
    if (!dashed_ || length == 0.0) return solid(a, b);
    for (double at = -std::fmod(run_, kDash + kGap); at < length; at += kDash + kGap) {
      const double begin = std::max(0.0, at);
      const double end = std::min(length, at + kDash);
      if (begin < end) solid(glm::mix(a, b, begin / length), glm::mix(a, b, end / length));
    }
    run_ += length;
  }
  void restart() { run_ = 0.0; }

  void paint(Image& image, const Color& color) const {
    for (std::uint32_t y = 0; y < height_; ++y) {
      for (std::uint32_t x = 0; x < width_; ++x) {
        const float cover = cover_[std::size_t{y} * width_ + x];
        if (cover > 0.0F) blend(image, x, y, color, cover);
      }
    }
  }

 private:
  void solid(const glm::dvec2& a, const glm::dvec2& b) {
    constexpr double kReach = kLineWidth / 2 + 0.5;
    const auto clamped = [](double v, std::uint32_t size) {
      return static_cast<std::uint32_t>(std::clamp(v, 0.0, static_cast<double>(size)));
    };
    const std::uint32_t x0 = clamped(std::min(a.x, b.x) - kReach, width_);
    const std::uint32_t x1 = clamped(std::max(a.x, b.x) + kReach + 1.0, width_);
    const std::uint32_t y0 = clamped(std::min(a.y, b.y) - kReach, height_);
    const std::uint32_t y1 = clamped(std::max(a.y, b.y) + kReach + 1.0, height_);
    const glm::dvec2 step = b - a;
    const double square = glm::dot(step, step);
    for (std::uint32_t y = y0; y < y1; ++y) {
      for (std::uint32_t x = x0; x < x1; ++x) {
        const glm::dvec2 p(x + 0.5, y + 0.5);
        const double t = square > 0.0 ? std::clamp(glm::dot(p - a, step) / square, 0.0, 1.0) : 0.0;
        const double cover = std::clamp(kReach - glm::length(p - (a + step * t)), 0.0, 1.0);
        float& kept = cover_[std::size_t{y} * width_ + x];
        kept = std::max(kept, static_cast<float>(cover));
      }
    }
  }

  std::uint32_t width_, height_;
  bool dashed_;
  double run_ = 0.0;  // along the curve so far
  std::vector<float> cover_;
};

// The least 1, 2 or 5 times a power of ten that is not below.
double round_step(double at_least) {
  const double power = std::pow(10.0, std::floor(std::log10(at_least)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= at_least * (1.0 - 1e-9)) return factor * power;
  }
  return 10.0 * power;
}

std::string tick_label(double value) {
  const double size = std::abs(value);
  if (size == 0.0) return "0";
  if (size >= 1e15 || size < 1e-4) return fmt::format("{:.3g}", value);
  for (const auto& [unit, letter] : {std::pair{1e12, "T"}, {1e9, "G"}, {1e6, "M"}, {1e3, "k"}}) {
    if (size >= unit * (1.0 - 1e-9)) return fmt::format("{:.6g}{}", value / unit, letter);
  }
  return fmt::format("{:.6g}", value);
}

std::vector<PlotTick> linear_ticks(double low, double high, std::size_t most_labels) {
  const double step = round_step((high - low) / static_cast<double>(std::max<std::size_t>(most_labels, 2)));
  std::vector<PlotTick> ticks;
  const double slack = step * 1e-9;
  for (double i = std::ceil((low - slack) / step); i * step <= high + slack && ticks.size() < 1000; ++i) {
    ticks.push_back({i * step + 0.0, tick_label(i * step)});
  }
  return ticks;
}

std::vector<PlotTick> logarithmic_ticks(double low, double high, std::size_t most_labels) {
  const double first = std::floor(std::log10(low) + 1e-9);
  const double last = std::floor(std::log10(high) + 1e-9);
  const double decades = std::log10(high / low);
  const double every = std::max(1.0, std::ceil(decades / static_cast<double>(std::max<std::size_t>(most_labels, 2))));
  // With few decades there is room for 2 and 5 as well.
  const bool halves = 3.0 * decades <= static_cast<double>(most_labels);
  std::vector<PlotTick> ticks;
  for (double decade = first; decade <= last; ++decade) {
    for (int digit = 1; digit <= 9; ++digit) {
      const double value = digit * std::pow(10.0, decade);
      if (value < low * (1.0 - 1e-9) || value > high * (1.0 + 1e-9)) continue;
      const bool labelled =
          (digit == 1 && std::fmod(decade - first, every) == 0.0) || (halves && (digit == 2 || digit == 5));
      if (labelled || every == 1.0) ticks.push_back({value, labelled ? tick_label(value) : std::string()});
    }
  }
  return ticks;
}

struct Scale {
  double low = 0.0, high = 1.0;
  bool logarithmic = false;
  double begin_px = 0.0, end_px = 1.0;

  double place(double value) const {
    double share = 0.0;
    if (!logarithmic) {
      share = (value - low) / (high - low);
    } else if (value > 0.0) {
      share = std::log(value / low) / std::log(high / low);
    }
    return begin_px + std::clamp(share, 0.0, 1.0) * (end_px - begin_px);
  }
};

Result<Scale> scale_of(const std::vector<PlotSeries>& series, const PlotAxis& axis, int coordinate) {
  Scale scale;
  scale.logarithmic = axis.logarithmic;
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const PlotSeries& s : series) {
    for (const glm::dvec2& p : s.points) {
      const double v = p[coordinate];
      if (!std::isfinite(v) || (axis.logarithmic && !(v >= kLeastLogarithmic && v <= kMostLogarithmic))) continue;
      low = std::min(low, v);
      high = std::max(high, v);
    }
  }
  if (!(low <= high)) low = 1.0, high = 10.0;
  if (axis.logarithmic) {
    const auto rounded = [](double v, double up) {
      const double power = std::pow(10.0, std::floor(std::log10(v)));
      return power * (up > 0.0 ? std::ceil(v / power - 1e-9) : std::floor(v / power + 1e-9));
    };
    scale.low = axis.low.value_or(rounded(low, -1.0));
    scale.high = axis.high.value_or(rounded(high, 1.0));
    if (!axis.high && scale.high <= scale.low) scale.high = scale.low * 10.0;
  } else {
    if (low >= 0.0) low = 0.0;
    if (high <= low) high = low + 1.0;
    const double step = round_step((high - low) / 10.0);
    scale.low = axis.low.value_or(std::floor(low / step + 1e-9) * step);
    scale.high = axis.high.value_or(std::ceil(high / step - 1e-9) * step);
  }
  const bool sound = std::isfinite(scale.low) && std::isfinite(scale.high) && scale.low < scale.high &&
                     std::isfinite(scale.high - scale.low) &&
                     (!axis.logarithmic || (scale.low > 0.0 && std::isfinite(scale.high / scale.low)));
  if (!sound)
    return fail(ErrorKind::usage,
                fmt::format("plot: axis '{}' cannot run from {} to {}", axis.label, scale.low, scale.high));
  return scale;
}

Color color_of(const std::vector<PlotSeries>& series, std::size_t i) {
  return series[i].color.value_or(kColors[i % kColors.size()]);
}

class Plotter {
 public:
  Plotter(const std::vector<PlotSeries>& series, const PlotOptions& options, const Scale& x, const Scale& y)
      : series_(series),
        options_(options),
        text_px_(options.text_height_px),
        x_(x),
        y_(y),
        image_(Image::filled(options.width, options.height, kPaper)) {}

  Image draw() {
    lay_out();
    draw_grid();
    draw_labels();
    draw_legend();
    for (std::size_t i = 0; i < series_.size(); ++i) draw_curve(i);
    return std::move(image_);
  }

 private:
  double line_px() const { return std::ceil(text_px_ * 1.35); }

  // Above the plot stand the title, and in one line the y axis' label and the legend; the legend's entries that have no
  // room beside the label take lines of their own.
  void lay_out() {
    const double edge = std::round(text_px_);
    const double label_px = text_width_px(options_.y.label, text_px_);
    double right_px = edge + label_px + 2 * text_px_;
    legend_lines_ = 1;
    for (const PlotSeries& s : series_) {
      const double entry_px = entry_width_px(s);
      if (right_px + entry_px > options_.width - edge && right_px > edge) {
        ++legend_lines_;
        right_px = edge;
      }
      legend_.push_back({right_px, legend_lines_ - 1});
      right_px += entry_px;
    }
    y_.end_px = edge + (options_.title.empty() ? 0.0 : 1.6 * line_px()) + legend_lines_ * line_px() + 0.4 * text_px_;
    y_.begin_px = options_.height - edge - 2.3 * line_px();
    const auto rows = static_cast<std::size_t>(std::max(2.0, (y_.begin_px - y_.end_px) / (2.2 * text_px_)));
    y_ticks_ = plot_ticks(y_.low, y_.high, y_.logarithmic, rows);
    double widest_px = 0.0;
    for (const PlotTick& tick : y_ticks_) widest_px = std::max(widest_px, text_width_px(tick.label, text_px_));
    x_.begin_px = std::round(edge + widest_px + 0.6 * text_px_);
    x_.end_px = std::round(options_.width - 1.6 * edge);
    const auto columns = static_cast<std::size_t>(std::max(2.0, (x_.end_px - x_.begin_px) / (4.0 * text_px_)));
    x_ticks_ = plot_ticks(x_.low, x_.high, x_.logarithmic, columns);
    y_.begin_px = std::round(y_.begin_px);
    y_.end_px = std::round(y_.end_px);
  }

  double entry_width_px(const PlotSeries& s) const {
    return 2.4 * text_px_ + text_width_px(s.name, text_px_) + 1.4 * text_px_;
  }

  void draw_grid() {
    for (const bool labelled : {false, true}) {  // lines with a label over those without
      for (const PlotTick& tick : x_ticks_) {
        if (tick.label.empty() == labelled) continue;
        const double x = std::round(x_.place(tick.value));
        fill_box(image_, x, y_.end_px, x + 1, y_.begin_px, labelled ? kGrid : kPaleGrid);
      }
      for (const PlotTick& tick : y_ticks_) {
        if (tick.label.empty() == labelled) continue;
        const double y = std::round(y_.place(tick.value));
        fill_box(image_, x_.begin_px, y, x_.end_px, y + 1, labelled ? kGrid : kPaleGrid);
      }
    }
    fill_box(image_, x_.begin_px, y_.begin_px, x_.end_px + 1, y_.begin_px + 1, kAxis);
    fill_box(image_, x_.begin_px, y_.end_px, x_.begin_px + 1, y_.begin_px, kAxis);
  }

  void draw_labels() {
    for (const PlotTick& tick : x_ticks_) {
      const double width_px = text_width_px(tick.label, text_px_);
      const double x = std::min(x_.place(tick.value) - width_px / 2, options_.width - width_px - 2.0);
      draw_text(image_, tick.label, x, y_.begin_px + 0.35 * text_px_, text_px_, kPaleInk);
    }
    for (const PlotTick& tick : y_ticks_) {
      const double x = x_.begin_px - 0.5 * text_px_ - text_width_px(tick.label, text_px_);
      draw_text(image_, tick.label, x, y_.place(tick.value) - 0.5 * text_px_, text_px_, kPaleInk);
    }
    const double edge = std::round(text_px_);
    const double x_label_px = text_width_px(options_.x.label, text_px_);
    draw_text(image_, options_.x.label, (x_.begin_px + x_.end_px - x_label_px) / 2,
              y_.begin_px + 0.35 * text_px_ + line_px(), text_px_, kInk);
    draw_text(image_, options_.title, edge, edge, text_px_ * 1.3, kInk);
    draw_text(image_, options_.y.label, edge, legend_top_px(0), text_px_, kInk);
  }

  double legend_top_px(unsigned line) const { return y_.end_px - 0.4 * text_px_ - (legend_lines_ - line) * line_px(); }

  void draw_legend() {
    for (std::size_t i = 0; i < series_.size(); ++i) {
      const auto& [x, line] = legend_[i];
      const double top = legend_top_px(line);
      Stroke sample(image_, series_[i].dashed);
      sample.line({x, top + 0.55 * text_px_}, {x + 1.9 * text_px_, top + 0.55 * text_px_});
      sample.paint(image_, color_of(series_, i));
      draw_text(image_, series_[i].name, x + 2.4 * text_px_, top, text_px_, kInk);
    }
  }

  void draw_curve(std::size_t i) {
    const PlotSeries& s = series_[i];
    Stroke stroke(image_, s.dashed);
    glm::dvec2 last(0.0);
    bool begun = false;
    for (const glm::dvec2& p : s.points) {
      if (std::isnan(p.x) || std::isnan(p.y)) {
        begun = false;
        stroke.restart();
        continue;
      }
      const glm::dvec2 here(x_.place(p.x) + 0.5, y_.place(p.y) + 0.5);
      if (!begun) last = here;
      begun = true;
      if (s.stepped) {
        const glm::dvec2 corner(here.x, last.y);
        stroke.line(last, corner);
        stroke.line(corner, here);
      } else {
        stroke.line(last, here);
      }
      last = here;
    }
    stroke.paint(image_, color_of(series_, i));
  }

  const std::vector<PlotSeries>& series_;
  const PlotOptions& options_;
  double text_px_;
  Scale x_, y_;
  Image image_;
  unsigned legend_lines_ = 1;
  std::vector<std::pair<double, unsigned>> legend_;  // left end and line of each entry
  std::vector<PlotTick> x_ticks_, y_ticks_;
};

}  // namespace

std::vector<PlotTick> plot_ticks(double low, double high, bool logarithmic, std::size_t most_labels) {
  // Less than a decade has too few powers of ten to read by.
  if (!logarithmic || high / low < 4.0) return linear_ticks(low, high, most_labels);
  return logarithmic_ticks(low, high, most_labels);
}

Result<Image> draw_plot(const std::vector<PlotSeries>& series, const PlotOptions& options) {
  if (options.width < 200 || options.height < 150 || options.width > 8192 || options.height > 8192) {
    return fail(ErrorKind::usage,
                fmt::format("plot: {}x{} pixels; 200x150 to 8192x8192 can be had", options.width, options.height));
  }
  std::size_t points = 0;
  for (const PlotSeries& s : series) points += s.points.size();
  if (series.empty() || series.size() > kMostSeries || points >= kMostPoints) {
    return fail(ErrorKind::usage, fmt::format("plot: {} series with {} points; 1 to {} with fewer than {} can be drawn",
                                              series.size(), points, kMostSeries, kMostPoints));
  }
  const Result<Scale> x = scale_of(series, options.x, 0);
  if (!x) return tl::unexpected(x.error());
  const Result<Scale> y = scale_of(series, options.y, 1);
  if (!y) return tl::unexpected(y.error());
  return Plotter(series, options, *x, *y).draw();
}

}  // namespace fanstream
