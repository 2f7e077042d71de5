// How far the cells are that still have splits to take.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "common/coding/fan_vertex.h"

namespace fanstream {

// Counts cells that own vertices and have not come to the end of their slab, by the finest generation that they have
// taken. No vertex of the mesh is to be split before the generation that the furthest behind of them takes next: those
// of other cells are split no more, or by children that are counted here.
class UnfinishedCells {
 public:
  void add(std::uint32_t generation) { ++cells_[generation]; }
  void remove(std::uint32_t generation) { --cells_[generation]; }
  // Whether some have not taken `generation`.
  bool any_before(std::uint32_t generation) const {
    return std::any_of(cells_.begin(), cells_.begin() + generation, [](std::uint32_t count) { return count != 0; });
  }

 private:
  std::array<std::uint32_t, kMostGenerations + 1> cells_{};
};

}  // namespace fanstream
