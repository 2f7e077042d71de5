#include "client/view/dependency_lists.h"

#include <algorithm>
#include <cassert>

namespace fanstream {

void DependencyLists::set(std::uint32_t cell, std::span<const Dependency> list) {
  assert(cell < cells_);
  Block& block = blocks_[cell / kBlockCells];
  if (block.ends.empty()) {
    if (list.empty()) return;
    block.ends.resize(kBlockCells);
  }
  const std::uint32_t begin = block.begin_of(cell);
  const std::uint32_t old_count = block.ends[cell % kBlockCells] - begin;
  const auto count = static_cast<std::uint32_t>(list.size());
  if (count > old_count) {
    const std::size_t wanted = block.list.size() + count - old_count;
    if (wanted > block.list.capacity()) block.list.reserve(wanted + wanted / 8);
    const auto at = block.list.begin() + begin;
    std::copy_n(list.begin(), old_count, at);
    block.list.insert(at + old_count, list.begin() + old_count, list.end());
  } else {
    const auto at = block.list.begin() + begin;
    block.list.erase(std::copy(list.begin(), list.end(), at), at + old_count);
  }
  for (std::uint32_t c = cell % kBlockCells; c < kBlockCells; ++c) block.ends[c] += count - old_count;
}

}  // namespace fanstream
