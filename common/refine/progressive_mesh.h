// The paper's PFanMesh at work: an asset's mesh between FM0 and the full model, refined cell by cell as segments
// arrive.
//
// Why any arrival order gives the same mesh: within a generation patches share no face, so their splits do not see each
// other; a cell takes up a generation only when every cell beside it has all coarser ones, so that each root's ring is
// the one the builder saw. Holding a set of segments therefore means one mesh, whichever way it came about.
#pragma once

#include <memory>

#include "common/asset/asset_layout.h"
#include "common/refine/cell_coder.h"

namespace fanstream {

// Starts as FM0. No I/O, no threads. Not thread safe; distinct objects are independent.
class ProgressiveMesh {
 public:
  explicit ProgressiveMesh(std::shared_ptr<const AssetHead> head);
  ProgressiveMesh(const ProgressiveMesh&) = delete;
  ProgressiveMesh& operator=(const ProgressiveMesh&) = delete;

  // The cell table may come later than FM0; nothing can be refined before. Call once.
  void set_index(std::shared_ptr<const AssetIndex> index);
  bool has_index() const { return index_ != nullptr; }

  // Takes a copy of a segment's bytes, in any order; a second copy is ignored. Fails if there is no such segment, or if
  // its size differs from the cell table's. Nothing is decoded yet.
  Result<void> add_segment(std::uint32_t cell, std::uint32_t segment, std::span<const std::byte> bytes);

  // Decodes and applies all that can be. Where that would make more than `vertex_limit` vertices, it goes generation by
  // generation, coarse to fine, and stops at that number or one cell's share of a generation more; a later call goes on
  // from there. Returns how many splits were applied. After an error the mesh stays drawable, but no more is refined.
  Result<std::uint64_t> refine(std::uint32_t vertex_limit = kMostVertices);

  // Undoes every generation finer than `generation` (0 is FM0), keeping the segments: refine() restores them exactly.
  // Only layer borders can be come back to, so it goes down to the next one at or below. Returns the splits undone.
  std::uint64_t coarsen_to(std::uint32_t generation);

  const AssetHead& head() const { return *head_; }
  const AssetIndex& index() const { return *index_; }
  const FanState& state() const { return state_; }
  std::uint32_t vertex_count() const { return vertex_count_; }  // of the mesh as it is now
  bool is_complete() const { return vertex_count_ == head_->vertex_count; }
  bool holds(std::uint32_t cell, std::uint32_t segment) const;
  // The coarsest generation that some cell still lacks, less one.
  std::uint32_t complete_generation() const;
  // The mesh as it is now in the model's coordinates; vertices are renumbered without gaps, in order; triangles are
  // ordered by their smallest vertices, which stand first.
  TriangleMesh triangle_mesh() const;
  std::size_t memory_bytes() const;

 private:
  struct Cell {
    CellVertices vertices;
    std::vector<std::vector<std::byte>> segments;  // held bytes by segment
    std::vector<bool> held;
    RansDecoder decoder;
    std::vector<RansDecoder> layer_starts;  // the decoder as it was before each segment that has been begun
    std::vector<SplitUndo> undo;
    std::vector<std::uint32_t> made_before;  // splits made before each applied generation of the slab
    std::uint32_t done = 0;  // the finest generation applied
    bool started = false;
  };

  void start_cells(std::span<const VertexId> parent_vertices, std::uint32_t first, std::uint32_t count,
                   std::uint32_t slab);
  std::uint32_t slab_end(std::uint32_t slab) const { return head_->layer_ends[head_->slab_ends[slab] - 1]; }
  std::uint32_t layer_of(std::uint32_t generation) const;
  void enqueue(std::uint32_t cell);
  bool next_segment_held(std::uint32_t cell) const;
  std::vector<std::uint32_t> take_waiting();
  Result<void> refine_evenly(std::uint32_t vertex_limit);
  Result<void> refine_in_depth();
  Result<void> advance(std::uint32_t cell, std::uint32_t generation);
  VertexId lagging_neighbour(const Cell& cell);
  Result<void> apply_generation(std::uint32_t cell_number);
  Result<void> decode_generation(Cell& cell, const CellEntry& entry, std::uint32_t generation);
  void roll_back(std::uint32_t cell_number, std::uint32_t target, std::uint32_t generation);
  void complete_cell(Cell& cell, const CellEntry& entry);
  std::uint64_t undo_generation(std::uint32_t cell_number);
  void retract_children(Cell& cell, std::uint32_t cell_number);
  std::vector<VertexId> vertices_of(const Cell& cell) const;

  std::shared_ptr<const AssetHead> head_;
  std::shared_ptr<const AssetIndex> index_;
  SplitModel model_;
  CellCoding coding_;
  FanState state_;
  std::vector<Cell> cells_;
  std::vector<std::vector<std::uint32_t>> waiting_;  // by next generation: started cells that hold its segment
  std::vector<std::vector<std::uint32_t>> refined_;  // by generation: the cells that have it, in the order they got it
  std::uint32_t vertex_count_ = 0;
  std::uint64_t applied_ = 0;
  bool failed_ = false;
};

}  // namespace fanstream
