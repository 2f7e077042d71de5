#include "client/collision/place_tree.h"

namespace fanstream {

void PlaceTree::widen(std::uint32_t cell, const Bounds& place) {
  FloatBox box = frame_.around(place);
  for (std::uint32_t slot = cells_.slot_of(cell); slot != CellHierarchy::kNone;) {
    const std::uint32_t n = slot / CellHierarchy::kWidth;
    const std::uint32_t k = slot % CellHierarchy::kWidth;
    const FloatBox before = boxes_[n].box(k);
    box.include(before);
    if (box == before) return;
    boxes_[n].set(k, box);
    slot = cells_.node(n).parent;
  }
}

PlaceTree::Sphere::Sphere(const std::optional<FocusSphere>& sphere, const BoxFrame& frame) {
  if (!sphere) return;
  centre = frame.to_float(sphere->centre);
  const double farthest = std::max({std::abs(centre.x), std::abs(centre.y), std::abs(centre.z)});
  // Boxes are padded for themselves; this is for the centre, and for what differences and squares are rounded by.
  const double reach = (sphere->radius / frame.step) * (1.0 + 1e-6) + 1e-6 * (farthest + frame.extent) + frame.padding;
  if (reach < 1e19) square = static_cast<float>(reach * reach);
}

}  // namespace fanstream
