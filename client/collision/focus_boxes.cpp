#include "client/collision/focus_boxes.h"

#include <bit>

namespace fanstream {

FocusBoxes::FocusBoxes(const FocusTest& focus, const BoxFrame& frame) : focus_(focus), frame_(frame) {
  const std::optional<FocusSphere>& sphere = focus.sphere();
  if (!sphere) return;
  centre_ = frame.to_float(sphere->centre);
  const double farthest = std::max({std::abs(centre_.x), std::abs(centre_.y), std::abs(centre_.z)});
  // Boxes are padded for themselves; this is for the centre, and for what differences and squares are rounded by.
  const double reach = (sphere->radius / frame.step) * (1.0 + 1e-6) + 1e-6 * (farthest + frame.extent) + frame.padding;
  if (reach < 1e19) square_ = static_cast<float>(reach * reach);
}

std::uint32_t FocusBoxes::in_region(const FourBoxes& boxes, std::uint32_t lanes) const {
  std::uint32_t left = 0;
  for (; lanes != 0; lanes &= lanes - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(lanes));
    if (focus_.region()(frame_.bounds(boxes.box(k)))) left |= 1U << k;
  }
  return left;
}

}  // namespace fanstream
