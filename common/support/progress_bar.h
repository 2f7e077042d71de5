// How far long work is, on standard error: a bar that is redrawn on a terminal, a line now and then anywhere else.
#pragma once

#include <chrono>
#include <string>
#include <string_view>

namespace fanstream {

// Not thread safe.
class ProgressBar {
 public:
  explicit ProgressBar(std::string label);  // "bunny.ply"
  ~ProgressBar();                           // finish()
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  // `fraction` in [0, 1], of the whole. Cheap to call often. `stage` is what is being done, in a word or two.
  void update(std::string_view stage, double fraction);
  // Takes the bar from the screen; what is printed next stands in its place.
  void finish();

 private:
  void draw(std::string_view stage, double fraction);

  std::string label_;
  bool on_terminal_ = false;
  bool drawn_ = false;
  std::chrono::steady_clock::time_point next_;
};

}  // namespace fanstream
