#include "client/collision/four_boxes.h"

#include <glm/common.hpp>

namespace fanstream {

Bounds united(const Bounds& a, const Bounds& b) { return {glm::min(a.low, b.low), glm::max(a.high, b.high)}; }

BoxFrame BoxFrame::of(const PositionGrid& grid) {
  BoxFrame frame;
  frame.origin = grid.decode({0, 0, 0});
  frame.step = std::max(grid.step(), 1e-300);  // of which the inverse is finite
  frame.extent = static_cast<double>(1 << grid.bits());
  const glm::dvec3 size = glm::abs(frame.origin);
  // An eighth of a step is the rounding of floats up to 2^20; a model far away from 0 is rounded by more in doubles.
  const double rounding = 4e-16 * (std::max({size.x, size.y, size.z}) / frame.step + frame.extent);
  frame.padding = std::min(0.125 + rounding, 1e30);  // where it is that much, boxes tell nothing
  return frame;
}

FloatBox BoxFrame::around(const Bounds& box) const {
  if (!(box.low.x <= box.high.x)) return {};
  const auto padding_of = [&](float value) { return static_cast<float>(padding) + 2.5e-7F * std::abs(value); };
  const glm::vec3 low = to_float(box.low);
  const glm::vec3 high = to_float(box.high);
  FloatBox result;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    result.low[a] = std::max(low[axis] - padding_of(low[axis]), -FloatBox::kFarthest);
    result.high[a] = std::min(high[axis] + padding_of(high[axis]), FloatBox::kFarthest);
  }
  return result;
}

Bounds BoxFrame::bounds(const FloatBox& box) const {
  if (box.is_empty()) return kNoBounds;
  return {origin + step * glm::dvec3(box.low[0], box.low[1], box.low[2]),
          origin + step * glm::dvec3(box.high[0], box.high[1], box.high[2])};
}

}  // namespace fanstream
