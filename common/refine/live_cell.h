// What a ProgressiveMesh keeps of a cell.
#pragma once

#include <limits>
#include <memory>
#include <vector>

#include "common/coding/rans.h"
#include "common/refine/cell_bounds.h"
#include "common/refine/cell_coder.h"

namespace fanstream {

// Of a cell that has been started: one of slab 0, or a child of a complete one.
struct LiveCell {
  struct Generation {
    std::uint32_t made_before = 0;  // splits
    RansDecoder::Mark decoder_before;
  };
  CellVertices vertices;
  std::vector<Generation> generations;  // of the slab, those applied
  RansDecoder::Mark decoder;            // after them
  std::vector<std::uint32_t>
      neighbours;                      // the childless cells that own a neighbour of its vertices; none with children
  std::vector<std::uint32_t> waiting;  // cells that cannot get on before this one does
  bool has_children = false;           // which own its vertices
  mutable bool bounds_known = false;
  mutable CellBounds bounds;

  std::size_t memory_bytes() const {
    return sizeof(LiveCell) + vertices.initial.capacity() * sizeof(VertexId) +
           generations.capacity() * sizeof(Generation) +
           (neighbours.capacity() + waiting.capacity()) * sizeof(std::uint32_t);
  }
};

struct CellProgress {
  static constexpr std::uint32_t kEverything = std::numeric_limits<std::uint32_t>::max();
  std::unique_ptr<LiveCell> live;
  std::uint32_t target = kEverything;  // segments to apply at most
  std::uint8_t done = 0;               // the finest generation applied; of a live cell
  std::uint8_t limit = 0;              // the finest that held segments, target and damage allow
  std::uint8_t reach = 0;              // the finest that held segments and damage allow
  std::uint8_t damaged = 0;            // a generation that cannot be decoded, or 0
  bool queued = false;                 // to be refined
  bool changed = false;                // and noted as such
};

}  // namespace fanstream
