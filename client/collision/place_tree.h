// Where the cells of an asset lie, as boxes under a tree: which of them a focus touches.
#pragma once

#include <bit>
#include <vector>

#include "client/collision/cell_hierarchy.h"
#include "client/collision/focus_boxes.h"

namespace fanstream {

// Keeps a reference to the hierarchy. Not thread safe, but for const members between changes.
class PlaceTree {
 public:
  // No cell lies anywhere.
  PlaceTree(const CellHierarchy& cells, const BoxFrame& frame)
      : cells_(cells), frame_(frame), boxes_(cells.node_count()) {}

  void clear() { boxes_.assign(boxes_.size(), {}); }
  // A cell lies in a box too, and so does what is above it.
  void widen(std::uint32_t cell, const Bounds& place);

  // Calls on_cell(cell) for all cells of which the place may be touched, one that others come from before those; below
  // it goes on if that says so. The logarithm of all cells, and what is found.
  template <class OnCell>
  void find(const FocusTest& focus, const OnCell& on_cell) const {
    const FloatBox all = boxes_[CellHierarchy::root()].sum();
    // A sphere may be so far away that floats could not tell.
    if (all.is_empty() || !focus.may_touch(frame_.bounds(all))) return;
    find_below(CellHierarchy::root(), FocusBoxes(focus, frame_), on_cell);
  }

 private:
  template <class OnCell>
  void find_below(std::uint32_t n, const FocusBoxes& focus, const OnCell& on_cell) const {
    const CellHierarchy::Node& node = cells_.node(n);
    for (std::uint32_t lanes = focus.touched(boxes_[n]); lanes != 0; lanes &= lanes - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(lanes));
      const bool go_on = node.cell[k] == CellHierarchy::kNone || on_cell(node.cell[k]);
      if (go_on && node.below[k] != CellHierarchy::kNone) find_below(node.below[k], focus, on_cell);
    }
  }

  const CellHierarchy& cells_;
  BoxFrame frame_;
  std::vector<FourBoxes> boxes_;  // by node
};

}  // namespace fanstream
