// What cells' generations need of others, as one list for each cell.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace fanstream {

// That a generation of a cell needs one of another cell. Generations are counted from 1 within the cell's slab.
struct Dependency {
  std::uint32_t generation : 8 = 0;
  std::uint32_t cell : 24 = 0;  // the other
  std::uint32_t on = 0;         // its generation
  friend bool operator==(const Dependency&, const Dependency&) = default;
};

// The lists of consecutive cells share memory, so that going through the cells in order is going through memory in
// order. A change of one costs what its block of 64 cells has. Not thread safe.
class DependencyLists {
 public:
  DependencyLists() = default;
  explicit DependencyLists(std::size_t cells) : blocks_((cells + kBlockCells - 1) / kBlockCells), cells_(cells) {}
  std::span<const Dependency> operator[](std::uint32_t cell) const {
    const Block& block = blocks_[cell / kBlockCells];
    if (block.ends.empty()) return {};
    const std::uint32_t begin = block.begin_of(cell);
    return {block.list.data() + begin, block.ends[cell % kBlockCells] - begin};
  }
  // `list` must not be part of these lists.
  void set(std::uint32_t cell, std::span<const Dependency> list);

 private:
  static constexpr std::uint32_t kBlockCells = 64;
  struct Block {
    std::vector<Dependency> list;
    std::vector<std::uint32_t> ends;  // by cell; empty where none of them has ever had any
    std::uint32_t begin_of(std::uint32_t cell) const {
      return cell % kBlockCells == 0 ? 0 : ends[cell % kBlockCells - 1];
    }
  };
  std::vector<Block> blocks_;
  std::size_t cells_ = 0;
};

}  // namespace fanstream
