#include "client/collision/cell_hierarchy.h"

namespace fanstream {

CellHierarchy::CellHierarchy(const AssetHead& head, const AssetIndex& index) : of_cell_(index.cells.size(), kNone) {
  add(kNone, 0, head.root_cell_count, index);
}

// Recursive: as deep as there are slabs, times the logarithm of the cells that are siblings.
std::uint32_t CellHierarchy::add(std::uint32_t parent, std::uint32_t first_cell, std::uint32_t count,
                                 const AssetIndex& index) {
  const auto n = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back().parent = parent;
  const std::uint32_t half = count / 2;  // as partition_vertices cuts
  const std::array<std::uint32_t, kWidth + 1> borders{0, half / 2, half, half + (count - half) / 2, count};
  for (std::uint32_t k = 0; k < kWidth; ++k) {
    const std::uint32_t size = borders[k + 1] - borders[k];
    if (size > 0) fill(kWidth * n + k, first_cell + borders[k], size, index);
  }
  return n;
}

void CellHierarchy::fill(std::uint32_t slot, std::uint32_t first_cell, std::uint32_t count, const AssetIndex& index) {
  std::uint32_t below = kNone;
  if (count > 1) {
    below = add(slot, first_cell, count, index);
  } else {
    const CellEntry& entry = index.cells[first_cell];
    nodes_[slot / kWidth].cell[slot % kWidth] = first_cell;
    of_cell_[first_cell] = slot;
    if (entry.child_count > 0) below = add(slot, entry.first_child, entry.child_count, index);
  }
  nodes_[slot / kWidth].below[slot % kWidth] = below;
}

}  // namespace fanstream
