#include "client/collision/cell_hierarchy.h"

#include <glm/common.hpp>

namespace fanstream {

Bounds united(const Bounds& a, const Bounds& b) { return {glm::min(a.low, b.low), glm::max(a.high, b.high)}; }

CellHierarchy::CellHierarchy(const AssetHead& head, const AssetIndex& index) : of_cell_(index.cells.size(), kNone) {
  nodes_.reserve(2 * index.cells.size());
  if (head.root_cell_count > 0) add(kNone, 0, head.root_cell_count, index);
}

// Recursive: as deep as there are slabs, times the logarithm of the cells that are siblings.
std::uint32_t CellHierarchy::add(std::uint32_t parent, std::uint32_t first_cell, std::uint32_t count,
                                 const AssetIndex& index) {
  const auto n = static_cast<std::uint32_t>(nodes_.size());
  nodes_.push_back({parent, {kNone, kNone}, kNone});
  if (count > 1) {
    const std::uint32_t left = add(n, first_cell, count / 2, index);
    nodes_[n].below = {left, add(n, first_cell + count / 2, count - count / 2, index)};
    return n;
  }
  nodes_[n].cell = first_cell;
  of_cell_[first_cell] = n;
  const CellEntry& entry = index.cells[first_cell];
  if (entry.child_count > 0) nodes_[n].below[0] = add(n, entry.first_child, entry.child_count, index);
  return n;
}

}  // namespace fanstream
