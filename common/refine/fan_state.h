// The mesh while it is refined and coarsened, and what coding remembers of each vertex.
#pragma once

#include <cstdint>
#include <vector>

#include "common/coding/base_coder.h"
#include "common/coding/fan_vertex.h"
#include "common/fans/ring_mesh.h"

namespace fanstream {

// Arrays by vertex number. Thread safety: like a standard container.
struct FanState {
  RingMesh rings;
  std::vector<FanVertex> vertices;   // place, and what coding remembers
  std::vector<std::uint32_t> cells;  // the deepest cell that holds the vertex
  std::vector<std::uint8_t> near_root;  // the last generation in which a neighbour of the vertex's own cell was split

  void resize(std::size_t vertex_count);
  std::vector<GridPoint> places() const;
  // The base mesh, no vertex split yet, in no cell; room for vertex_count vertices.
  static FanState from_base(const BaseMesh& base, std::size_t vertex_count);
};

// Applies a split of a vertex of `cell`; its wings are positions in the root's ring, given twice around (RingMesh::split).
// `generation` counts from 1, `places` are those after the split.
void apply_split(FanState& state, std::uint32_t cell, std::uint32_t generation, const FanSplit& split,
                 const VertexId* ring_twice, std::uint32_t ring_size, const SplitPlaces& places, VertexId added);

// What the exact inverse of a split needs to know beyond the mesh.
struct SplitUndo {
  VertexId root = 0;
  VertexContext root_context;
  ParentPosition parent = ParentPosition::kept;
};
// Precondition: the split that made `added` is the latest of its surroundings.
void undo_split(FanState& state, std::uint32_t cell, std::uint32_t generation, const SplitUndo& undo, VertexId added);

}  // namespace fanstream
