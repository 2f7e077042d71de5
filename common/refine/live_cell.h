// What a ProgressiveMesh keeps of a cell.
#pragma once

#include <limits>
#include <memory>

#include "common/coding/rans.h"
#include "common/refine/cell_vertices.h"
#include "common/support/compact_list.h"

namespace fanstream {

// Of a cell that has been started: one of slab 0, or a child of a complete one.
struct LiveCell {
  struct Generation {
    std::uint32_t made_before = 0;  // splits
    RansDecoder::Mark decoder_before;
  };
  CellVertices vertices;
  CompactList<Generation> generations;  // of the slab, those applied
  RansDecoder::Mark decoder;            // after them
  // The childless cells that own a neighbour of its vertices; none with children.
  CompactList<std::uint32_t> neighbours;
  CompactList<std::uint32_t> waiting;  // cells that cannot get on before this one does
  bool has_children = false;           // which own its vertices

  std::size_t memory_bytes() const {
    return sizeof(LiveCell) + vertices.initial.memory_bytes() + vertices.slots.memory_bytes() +
           generations.memory_bytes() + neighbours.memory_bytes() + waiting.memory_bytes();
  }
};

struct CellProgress {
  static constexpr std::uint32_t kEverything = std::numeric_limits<std::uint32_t>::max();
  static constexpr std::uint8_t kAll = 255;  // more than a cell has
  std::unique_ptr<LiveCell> live;
  std::uint8_t kept_target = kAll;  // segments to apply at most
  std::uint8_t done = 0;            // the finest generation applied; of a live cell
  std::uint8_t limit = 0;           // the finest that held segments, target and damage allow
  std::uint8_t reach = 0;           // the finest that held segments and damage allow
  std::uint8_t damaged = 0;         // a generation that cannot be decoded, or 0
  std::uint8_t goal = 0;            // the generation to get to in this move, or 0
  bool queued : 1 = false;          // to be refined
  bool changed : 1 = false;         // and noted as such
  bool changed_around : 1 = false;  // so are the cells beside it
  bool blocked : 1 = false;         // cannot get on in this move

  std::uint32_t target() const { return kept_target == kAll ? kEverything : kept_target; }
  void set_target(std::uint32_t segments) {
    kept_target = segments < kAll ? static_cast<std::uint8_t>(segments) : kAll;
  }
};

}  // namespace fanstream
