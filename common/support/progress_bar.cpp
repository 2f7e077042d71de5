#include "common/support/progress_bar.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>

namespace fanstream {
namespace {

constexpr std::size_t kBarCells = 24;
constexpr auto kRedraw = std::chrono::milliseconds(100);
constexpr auto kPlainLine = std::chrono::seconds(5);

}  // namespace

ProgressBar::ProgressBar(std::string label)
    : label_(std::move(label)), on_terminal_(::isatty(STDERR_FILENO) != 0), next_(std::chrono::steady_clock::now()) {
  if (!on_terminal_) next_ += kPlainLine;  // nothing is said of what takes less
}

ProgressBar::~ProgressBar() { finish(); }

void ProgressBar::update(std::string_view stage, double fraction) {
  const auto now = std::chrono::steady_clock::now();
  if (now < next_) return;
  next_ = now + (on_terminal_ ? std::chrono::steady_clock::duration(kRedraw)
                              : std::chrono::steady_clock::duration(kPlainLine));
  draw(stage, std::clamp(fraction, 0.0, 1.0));
}

void ProgressBar::draw(std::string_view stage, double fraction) {
  const int percent = static_cast<int>(fraction * 100.0);
  if (!on_terminal_) {
    fmt::print(stderr, "{}: {} ({} %)\n", label_, stage, percent);
    return;
  }
  const auto filled = static_cast<std::size_t>(fraction * kBarCells);
  // Fits 80 columns, whatever the names: a line that wraps cannot be redrawn.
  fmt::print(stderr, "\r\x1b[K{:.26} [{}{}] {:3} % {:.16}", label_, std::string(filled, '#'),
             std::string(kBarCells - filled, '.'), percent, stage);
  std::fflush(stderr);
  drawn_ = true;
}

void ProgressBar::finish() {
  if (drawn_) fmt::print(stderr, "\r\x1b[K");
  drawn_ = false;
}

}  // namespace fanstream
