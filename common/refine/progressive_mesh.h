// The paper's PFanMesh at work: an asset's mesh between FM0 and the full model, refined and coarsened cell by cell, as
// segments arrive and as a view wants it.
//
// Why any order gives the same mesh: within a generation patches share no face, so their splits do not see each other;
// a cell takes up a generation only when all that is to come around its roots is finer, so that each root's ring is the
// one the builder saw. A set of held segments, and of targets, therefore means one mesh, whichever way it came about:
// the largest that this rule allows (CODING.md, section 9).
#pragma once

#include <memory>

#include "common/asset/asset_layout.h"
#include "common/refine/cell_bounds.h"
#include "common/refine/cells_decoder.h"
#include "common/refine/generation_queue.h"
#include "common/refine/held_segments.h"
#include "common/refine/live_cell.h"
#include "common/refine/unfinished_cells.h"

namespace fanstream {

// What a mesh is for, which decides how its memory is laid out.
enum class MeshMemory : std::uint8_t {
  whole_model,  // it is refined fully: room for all of it, on huge pages where there are some
  // It follows a view: memory for what is in the mesh alone, page by page, given back when it is coarsened; and what a
  // planner looks at is kept.
  live_part,
};

// What a cell's target asks of move_to.
enum class TargetMeaning : std::uint8_t {
  most,  // to be no finer than this: the mesh is the largest within all targets
  // To be as fine as this. The mesh is the smallest that has all that is wanted: cells that others need go along as far
  // as these need them, beyond their own targets. It does not depend on the way there either, as long as whoever wants
  // something of a cell wants all of its parent.
  wanted,
};

// No more than the first `segments` segments of a cell are to be applied.
struct CellTarget {
  std::uint32_t cell = 0;
  std::uint32_t segments = 0;
};

// What move_to has done.
struct MeshMove {
  struct Damage {
    std::uint32_t cell = 0;
    std::uint32_t segment = 0;
    Error error;
  };
  std::uint64_t applied = 0;   // splits
  std::uint64_t undone = 0;    // splits
  bool finished = true;        // false: the budget was used up, more is to be done
  std::vector<Damage> damage;  // segments that turned out not to be decodable, now
};

// Starts as FM0. No I/O, no threads. Not thread safe; distinct objects are independent.
class ProgressiveMesh {
 public:
  static constexpr std::uint32_t kEverySegment = CellProgress::kEverything;
  static constexpr std::uint64_t kNoBudget = std::numeric_limits<std::uint64_t>::max();

  explicit ProgressiveMesh(std::shared_ptr<const AssetHead> head, MeshMemory memory = MeshMemory::whole_model);
  ProgressiveMesh(const ProgressiveMesh&) = delete;
  ProgressiveMesh& operator=(const ProgressiveMesh&) = delete;

  // The cell table may come later than FM0; nothing can be refined before. Call once.
  void set_index(std::shared_ptr<const AssetIndex> index);
  bool has_index() const { return index_ != nullptr; }
  // The index, which is still the same object, has come to know the children of this cell (read_page). What it does not
  // know stays as it is.
  void learn_children(std::uint32_t parent);

  // Takes a copy of a segment's bytes, in any order; a second copy is ignored. Fails if there is no such segment, or if
  // size differs from the cell table's. Nothing is decoded yet. Pages are ignored: they are for the index. The polygon
  // section (AssetIndex::polygon_cell) is taken like any other segment, but means nothing to the mesh: it is kept for
  // SourcePolygons.
  Result<void> add_segment(std::uint32_t cell, std::uint32_t segment, std::span<const std::byte> bytes);
  std::span<const std::byte> polygon_bytes() const { return polygons_; }  // empty: not held, or there are none
  // Frees the bytes of a cell's segments from number `keep` on, but not of those of which a generation is applied:
  // lower the target and move first. They may be added again. Returns the bytes freed.
  std::size_t release_segments(std::uint32_t cell, std::uint32_t keep);

  // Decodes and applies all that is held, whatever the targets were: they are dropped. Where that would make more than
  // `vertex_limit` vertices, it goes generation by generation, coarse to fine, and stops at that number or one cell's
  // share of a generation more; a later call goes on from there. Returns how many splits were applied. After an error
  // the mesh stays drawable, but refine() does no more.
  Result<std::uint64_t> refine(std::uint32_t vertex_limit = kMostVertices);

  // Undoes every generation finer than `generation` (0 is FM0), keeping segments and targets: refine() restores them
  // exactly. Goes down to the next layer border at or below. Returns the splits undone.
  std::uint64_t coarsen_to(std::uint32_t generation);

  // Sets the targets of these cells (at first, every cell's is kEverySegment; of a cell named twice the last counts)
  // and goes to the largest mesh within targets and held segments that the implicit rule allows. What is beyond it is
  // undone first, then what is missing is applied, beginning with the cells named first. Costs time for what changes,
  // not for what is there. Stops when `split_budget` splits have been applied or undone, or one cell's share of a
  // generation more, at a mesh that is as good as any; the next call goes on. A cell whose segment cannot be decoded
  // stays as it is without it until the segment is released; the others go on. Precondition: has_index(), and the cells
  // exist.
  MeshMove move_to(std::span<const CellTarget> targets, std::uint64_t split_budget = kNoBudget);
  // Sets every cell's target, to take effect with the next move_to.
  void set_all_targets(std::uint32_t segments);
  // TargetMeaning::most at first. To be chosen before the first move_to, and not to be mixed with refine(). With
  // `wanted`, move_to refines before it coarsens, and a cell that needs what is not held is as
  // fine as it can be; what it waits for stays.
  void set_target_meaning(TargetMeaning meaning) { meaning_ = meaning; }

  const AssetHead& head() const { return *head_; }
  const AssetIndex& index() const { return *index_; }
  // A MeshMemory::live_part has vertices under numbers of its own, those of FM0 aside, which depend on the way there; a
  // vertex keeps its number for as long as it is in the mesh. A whole_model has the asset's: FM0's, then cell by cell
  // in the order in which they are made.
  const FanState& state() const { return state_; }
  // The mesh's vertices as state() has them, in the order of the asset's numbers; takes time for what is there.
  std::vector<VertexId> vertices_in_order() const;
  // By vertex of state(): its number in the asset; 0 where there is none.
  std::vector<VertexId> asset_numbers() const;
  std::uint32_t vertex_count() const { return vertex_count_; }  // of the mesh as it is now
  bool is_complete() const { return vertex_count_ == head_->vertex_count; }
  bool holds(std::uint32_t cell, std::uint32_t segment) const;
  // The coarsest generation that some cell still lacks, less one.
  std::uint32_t complete_generation() const;
  // The mesh as it is now in the model's coordinates; vertices are those of vertices_in_order(); triangles are
  // ordered by their smallest vertices, which stand first.
  TriangleMesh triangle_mesh() const;
  // What the mesh takes, segments included, what the allocator adds not; the head and the index are not the mesh's own.
  std::size_t memory_bytes() const;

  // What a planner looks at, by cell. Neighbours, bounds and changes are those of a MeshMemory::live_part alone.
  //
  // Whether the cell owns vertices of the mesh, if it has any: its parent is complete, it is not (or has no children).
  bool is_live(std::uint32_t cell) const { return cells_[cell].live && !cells_[cell].live->has_children; }
  std::uint32_t target(std::uint32_t cell) const { return cells_[cell].target(); }
  std::uint32_t held_prefix(std::uint32_t cell) const { return held_.prefix(cell); }
  std::uint32_t applied_prefix(std::uint32_t cell) const;  // whole segments
  std::uint32_t begun_prefix(std::uint32_t cell) const;    // those of which the first generation is applied
  // The finest generation applied; 0 for a cell whose parent is not complete.
  std::uint32_t applied_generation(std::uint32_t cell) const { return cells_[cell].live ? cells_[cell].done : 0; }
  // The live cells that own a neighbour of one of a live cell's vertices, in no order.
  std::span<const std::uint32_t> neighbours(std::uint32_t cell) const { return cells_[cell].live->neighbours; }
  // The cells that hold up the next segment of a live cell, as far as its vertices tell already: they own a neighbour
  // of a vertex that is split in one of the segment's generations, and have to split it before. In no order.
  void find_blocking(std::uint32_t cell, std::vector<std::uint32_t>& found) const;
  // What splits of a live cell's own slab have been applied on top of: the latest generation of each other cell that a
  // vertex beside one of the cell's was split or made in before the cell's own was. By cell that owns the other vertex
  // now, which may be a descendant of the one that split it.
  struct Support {
    std::uint32_t generation = 0;  // of the cell's split
    std::uint32_t cell = 0;
    std::uint32_t on = 0;  // the generation before it
  };
  void find_supports(std::uint32_t cell, std::vector<Support>& found) const;
  // What a live cell's splits of its own slab still wait for, as far as its vertices tell already: they know of each
  // vertex beside them in which generation that is split next. By cell that owns the other vertex now; where `on` is
  // beyond the other cell's slab, a descendant of it will.
  void find_needs(std::uint32_t cell, std::vector<Support>& found) const;
  const CellVertices& vertices(std::uint32_t cell) const { return cells_[cell].live->vertices; }  // of a live cell
  // Of a live cell. Computed each time: they change with the cell and its neighbours only.
  CellBounds bounds(std::uint32_t cell) const;
  // The corners of the faces that the last call of bounds() was about, some of them more than once. May be reordered.
  std::span<glm::dvec3> bounded_corners() const { return scratch_.points; }
  // The cells of which live or not, prefixes, neighbours or bounds may have changed since the last call, each once, in
  // no order. The first call names those that were ever touched.
  std::vector<std::uint32_t> take_changed_cells();

 private:
  static constexpr std::size_t kMostSteps = 16;
  struct Work;  // what a call has done and may still do
  // A cell takes its next generation: the roots of it in coding_.roots.
  struct Step {
    std::uint32_t cell = 0;
    std::size_t roots_begin = 0;
    std::size_t roots_end = 0;
  };

  Result<void> keep_polygons(std::span<const std::byte> bytes);
  void start_cells(std::span<const VertexId> parent_vertices, std::uint32_t first, std::uint32_t count,
                   std::uint32_t slab);
  std::uint32_t slab_begin(std::uint32_t slab) const;  // the last generation before it
  std::uint32_t slab_end(std::uint32_t slab) const { return head_->layer_ends[head_->slab_ends[slab] - 1]; }
  std::uint32_t layer_of(std::uint32_t generation) const;
  std::uint32_t segment_of(std::uint32_t cell, std::uint32_t generation) const;
  void update_limit(std::uint32_t cell);
  void queue(std::uint32_t cell);
  bool watched() const { return pages_ == PageKind::small; }  // whether what a planner looks at is kept
  void note_change(std::uint32_t cell);
  void note_change_around(std::uint32_t cell);
  void note_neighbours_changed(std::uint32_t cell);

  void refine_evenly(std::uint32_t vertex_limit, Work& work);
  void refine_queued(Work& work);
  void advance(Work& work);
  void set_goal(std::uint32_t cell, std::uint32_t generation);
  void take_step(Work& work);
  void fetch_ahead() const;
  bool is_ready(const Step& step, std::uint32_t generation, const Work& work);
  bool ask_for(std::uint32_t lagging, std::uint32_t generation, const Work& work);
  std::uint32_t most_splits_left(std::uint32_t cell) const;
  void wait_for(std::uint32_t cell, std::uint32_t lagging);
  void wake_waiting(std::uint32_t cell);
  bool can_advance(std::uint32_t cell) const;
  VertexId find_later(std::uint32_t cell, std::uint32_t& from) const;
  void find_neighbours(std::uint32_t cell);
  void hand_over_neighbours(std::uint32_t parent);
  void take_back_neighbours(std::uint32_t parent);
  void apply_generation(std::uint32_t generation, Work& work);
  CellToDecode start_decoding(const Step& step, std::uint32_t generation);
  Result<void> end_decoding(std::uint32_t cell, std::uint32_t generation, const RansDecoder& decoder);
  void finish_generation(std::uint32_t cell, const LiveCell::Generation& before, Result<void> decoded, Work& work);
  Result<void> check_end(std::uint32_t cell) const;
  void complete_cell(std::uint32_t cell);

  void fetch_excess() const;
  void coarsen_excess(Work& work);
  void coarsen_unneeded(Work& work);
  bool is_needed(std::uint32_t cell) const;
  bool is_awaited(std::uint32_t cell) const;
  void note_less_needed(std::uint32_t cell);
  bool undo_generation(std::uint32_t cell, Work& work);
  void retract_children(std::uint32_t cell);
  void roll_back(std::uint32_t cell, std::uint32_t target, std::uint32_t generation);
  void drop_targets();
  std::vector<VertexId> vertices_of(const LiveCell& cell) const;

  std::shared_ptr<const AssetHead> head_;
  std::shared_ptr<const AssetIndex> index_;
  SplitModel model_;
  CellCoding coding_;
  FanState state_;
  HeldSegments held_;
  std::vector<std::byte> polygons_;
  std::vector<CellProgress> cells_;
  std::vector<std::uint32_t> queue_;   // cells that may be able to take another generation
  std::vector<std::uint32_t> excess_;  // cells that may be finer than they should be
  std::vector<std::uint32_t> changed_;
  UnfinishedCells unfinished_;
  // In use while cells advance.
  GenerationQueue advancing_;  // cells with goals
  std::vector<std::uint32_t> blocked_;
  std::vector<Step> steps_;
  std::vector<CellToDecode> decoding_;
  std::vector<std::uint32_t> found_;
  mutable BoundsScratch scratch_;
  std::uint32_t vertex_count_ = 0;
  PageKind pages_;
  TargetMeaning meaning_ = TargetMeaning::most;
  bool targets_set_ = false;
  bool failed_ = false;
};

}  // namespace fanstream
