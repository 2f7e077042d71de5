#include "client/view/dependency_lists.h"

#include <algorithm>
#include <cassert>

namespace fanstream {

void DependencyLists::set(std::uint32_t cell, std::span<const Dependency> list) {
  assert(cell < ends_.size());
  std::vector<Dependency>& block = blocks_[cell / kBlockCells];
  const std::uint32_t begin = begin_of(cell);
  const std::uint32_t old_count = ends_[cell] - begin;
  const auto count = static_cast<std::uint32_t>(list.size());
  if (count > old_count) {
    const std::size_t wanted = block.size() + count - old_count;
    if (wanted > block.capacity()) block.reserve(wanted + wanted / 8);
    const auto at = block.begin() + begin;
    std::copy_n(list.begin(), old_count, at);
    block.insert(at + old_count, list.begin() + old_count, list.end());
  } else {
    const auto at = block.begin() + begin;
    block.erase(std::copy(list.begin(), list.end(), at), at + old_count);
  }
  const std::size_t next_block = (cell / kBlockCells + std::size_t{1}) * kBlockCells;
  for (std::size_t c = cell; c < std::min(next_block, ends_.size()); ++c) ends_[c] += count - old_count;
}

}  // namespace fanstream
