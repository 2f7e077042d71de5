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

}  // namespace fanstream
