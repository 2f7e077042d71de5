// The mesh while it is refined and coarsened, and what coding remembers of each vertex.
#pragma once

#include <cstdint>
#include <vector>

#include "common/fans/ring_mesh.h"
#include "common/fans/fan_split.h"

namespace fanstream {

// Facts about a vertex that are the same whichever legal order splits were applied in, since only splits of its own
// cell count. Generations here start at 1; 0 is the base.
struct VertexContext {
  std::uint8_t valence = 0;    // when it was last split or made, plus the wings it has been since; modulo 256
  std::uint8_t touched = 0;    // the generation of that split
  std::uint8_t near_root = 0;  // the last generation in which a neighbour of its own cell was split
};

// Arrays by vertex number. Thread safety: like a standard container.
struct FanState {
  RingMesh rings;
  std::vector<GridPoint> places;
  std::vector<VertexContext> contexts;
  std::vector<std::uint32_t> cells;  // the deepest cell that holds the vertex

  void resize(std::size_t vertex_count);
};

// Applies a split whose wings are positions in the ring as it is stored now (not in canonical order), for a vertex of `cell`.
// `generation` counts from 1. Precondition: RingMesh::split's.
void apply_split(FanState& state, std::uint32_t cell, std::uint32_t generation, const FanSplit& split, VertexId added);

// What the exact inverse of a split needs to know beyond the mesh.
struct SplitUndo {
  VertexId root = 0;
  VertexContext root_context;
  ParentPosition parent = ParentPosition::kept;
};
// Precondition: the split that made `added` is the latest of its surroundings.
void undo_split(FanState& state, std::uint32_t cell, std::uint32_t generation, const SplitUndo& undo, VertexId added);

}  // namespace fanstream
