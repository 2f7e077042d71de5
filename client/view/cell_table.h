// What the planner knows of a model's cells: the tree of the asset's index, and what of it is applied, held and seen.
// Plain arrays; a change of one cell costs what that cell has.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "client/view/criteria.h"
#include "client/view/dependency_lists.h"
#include "client/view/narrow_counts.h"
#include "common/support/paged_array.h"
#include "common/support/result.h"

namespace fanstream {

struct SlabShape {
  std::uint32_t cell_count = 0;
  std::uint32_t layer_count = 0;  // segments of each of its cells
};

// One segment. `error` is how far the cell's part of the surface may be off the original while the cell lacks this
// segment and has all before it, in the model's units.
struct CellSegment {
  float error = 0.0F;
  std::uint32_t size_bytes = 0;
  std::uint32_t triangles = 0;  // that applying it adds: two a split, or an estimate before it is decoded
};

// Cells are numbered by slab, coarse to fine, within a slab by parent, as in the asset's index. A *step* is one segment
// of one cell: step p (1 .. layer_count) of a cell takes it from prefix p-1 to p. Steps are stored by layer, then by
// cell: step_index(cell, p). So every step lies behind all it depends on.
//
// A layer may join several *generations*. Then a step is *begun* when its first generation is in the mesh, and applied
// when all are.
//
// **The rule of dependencies.** A generation of a cell needs
//   - the one before it of the same cell, the first one all of its parent;
//   - what add_needs has told: generations of other cells that were found to hold it up;
//   - where it is applied, what set_supports has told: those that it lies on.
// What is not told is not known, and nothing is forced by it.
//
// Not thread safe. Setters assert that cell numbers and prefixes exist.
class CellTable {
 public:
  CellTable() = default;
  // `child_counts` is for the cells of all slabs but the last, in order, and adds up to the cells of the later slabs.
  // Fails (bad_input) where it does not, or where there are more than 2^22 cells, 255 slabs or 250 layers.
  static Result<CellTable> create(std::span<const SlabShape> slabs, std::span<const std::uint32_t> child_counts);

  void set_segment(std::uint32_t cell, std::uint32_t segment, const CellSegment& values);
  void set_base(std::uint64_t triangles, std::uint64_t memory_bytes);  // FM0; the bytes besides those of its triangles
  // How many generations a layer (from 0) of a slab joins; 1 unless set. At least 1.
  void set_layer_generations(std::uint32_t slab, std::uint32_t layer, std::uint32_t generations);
  // Once all segments are set: fails (bad_input), naming the cell, where a bound is not finite or is negative, or rises
  // along the segments of a cell or from a cell to a child.
  Result<void> check_errors() const;

  // The state. `applied`: segments of which all generations are in the mesh; `begun`: of which the first one is, as
  // many or one more; `held`: segments received and not evicted, at least those begun.
  void set_applied(std::uint32_t cell, std::uint32_t prefix) { set_applied(cell, prefix, prefix); }
  void set_applied(std::uint32_t cell, std::uint32_t prefix, std::uint32_t begun);
  void set_held(std::uint32_t cell, std::uint32_t prefix);
  // Of the cell's part of the original: what is known of the mesh as it is now, inflated by the cell's error. Keep it
  // when the cell disappears, and let it change in one direction only, only tighter or only wider, or a still camera
  // may not come to rest. A cell without counts as lying anywhere in its parent's; one of slab 0 without as being
  // everywhere.
  //
  // `parts`: spheres of which the convex hull holds the same piece, or none; for one cell always as many.
  //
  // Kept in single precision about the origin, a little wider where that rounds.
  void set_extent(std::uint32_t cell, const CellExtent& extent, std::span<const ExtentPart> parts = {});
  void set_origin(const glm::dvec3& origin) { origin_ = origin; }  // of extents, before any is set: the model's middle
  // Adds to what is known to be needed by generations of a cell. What is implied by others is dropped; nothing else
  // ever is: so a still camera comes to rest, and one that comes back finds it. Each names another cell, of the same
  // slab and an earlier generation, or of a coarser slab.
  void add_needs(std::uint32_t cell, std::span<const Dependency> needs);
  // What the applied generations of a cell lie on, in place of what was said before: it is not coarsened for as long as
  // the cell is to stay as it is.
  void set_supports(std::uint32_t cell, std::span<const Dependency> supports);

  std::uint32_t cell_count() const { return static_cast<std::uint32_t>(parent_.size()); }
  std::uint32_t slab_count() const { return static_cast<std::uint32_t>(slabs_.size()); }
  std::uint32_t step_count() const { return static_cast<std::uint32_t>(errors_.size()); }
  std::uint32_t slab_of(std::uint32_t cell) const { return slab_of_[cell]; }
  std::uint32_t parent(std::uint32_t cell) const { return parent_[cell]; }  // kNoCell in slab 0
  std::uint32_t first_child(std::uint32_t cell) const { return has_children(cell) ? first_child_[cell] : 0; }
  std::uint32_t child_count(std::uint32_t cell) const {
    return has_children(cell) ? first_child_[cell + 1] - first_child_[cell] : 0;
  }
  std::uint32_t segment_count(std::uint32_t cell) const { return slabs_[slab_of_[cell]].layer_count; }
  std::uint32_t first_cell(std::uint32_t slab) const { return slabs_[slab].first_cell; }
  std::uint32_t cells_of(std::uint32_t slab) const { return slabs_[slab].cell_count; }
  std::uint32_t layers_of(std::uint32_t slab) const { return slabs_[slab].layer_count; }
  std::uint32_t layer_generations(std::uint32_t slab, std::uint32_t layer) const {
    return slabs_[slab].generations[layer];
  }
  // Of all the slab's layers together.
  std::uint32_t generations_of(std::uint32_t slab) const { return slabs_[slab].generation_count; }
  // The step that a generation of a cell belongs to.
  std::uint32_t step_of(std::uint32_t cell, std::uint32_t generation) const {
    return slabs_[slab_of_[cell]].step_of[generation - 1];
  }
  std::uint32_t last_generation(std::uint32_t cell, std::uint32_t p) const {
    return slabs_[slab_of_[cell]].last_generation[p - 1];
  }
  bool joins_generations() const { return joins_generations_; }  // whether any layer has more than one
  // Layers are counted over all slabs.
  std::uint32_t layer_count() const {
    return slabs_.empty() ? 0 : slabs_.back().first_layer + slabs_.back().layer_count;
  }
  std::uint32_t first_layer(std::uint32_t slab) const { return slabs_[slab].first_layer; }
  std::uint32_t layer_of(std::uint32_t cell, std::uint32_t p) const {
    return slabs_[slab_of_[cell]].first_layer + p - 1;
  }
  // Of step 1 of the slab's first cell; the steps of one layer are cells_of(slab) apart from the next layer's.
  std::uint32_t first_step(std::uint32_t slab) const { return slabs_[slab].first_step; }
  std::uint32_t step_index(std::uint32_t cell, std::uint32_t p) const {
    const Slab& slab = slabs_[slab_of_[cell]];
    return slab.first_step + (p - 1) * slab.cell_count + (cell - slab.first_cell);
  }
  std::span<const float> errors() const { return {errors_.data(), errors_.size()}; }  // by step: before it is applied
  const NarrowCounts& sizes_bytes() const { return sizes_bytes_; }
  const NarrowCounts& triangles() const { return triangles_; }
  // How far the cell is off at prefix p; once complete, the most that any of its children is.
  float error_at(std::uint32_t cell, std::uint32_t p) const;
  std::uint64_t base_triangles() const { return base_triangles_; }
  std::uint64_t base_memory_bytes() const { return base_memory_bytes_; }

  // Sums over all cells: triangles and bytes of the segments begun, bytes of those held.
  std::uint64_t begun_triangles() const { return begun_triangles_; }
  std::uint64_t begun_bytes() const { return begun_bytes_; }
  std::uint64_t held_bytes() const { return held_bytes_; }

  std::uint32_t applied(std::uint32_t cell) const { return applied_[cell]; }
  std::uint32_t begun(std::uint32_t cell) const { return begun_[cell]; }
  // What is held, with empty segments that follow: they need not be sent.
  std::uint32_t held(std::uint32_t cell) const;
  bool extent_known(std::uint32_t cell) const { return extent_numbers_[cell] != kNoExtent; }
  // Cells are numbered in the order in which their extents became known.
  std::uint32_t extent_count() const { return static_cast<std::uint32_t>(extents_.size()); }
  std::uint32_t extent_number(std::uint32_t cell) const { return extent_numbers_[cell]; }
  CellExtent extent(std::uint32_t cell) const;
  void copy_parts(std::uint32_t cell, std::vector<ExtentPart>& parts) const;
  std::uint64_t extent_epoch(std::uint32_t cell) const {  // of the last change, 0 where none is known
    return extent_known(cell) ? extents_[extent_numbers_[cell]].epoch : 0;
  }
  std::uint64_t epoch() const { return epoch_; }  // rises with every change of the state

  // By falling generation, then by cell.
  std::span<const Dependency> needs(std::uint32_t cell) const { return needs_[cell]; }
  std::span<const Dependency> supports(std::uint32_t cell) const { return supports_[cell]; }
  // The epoch of the last change of needs or supports of the cell or one numbered close to it; the last of all cells.
  std::uint64_t dependency_epoch(std::uint32_t cell) const { return dependency_epochs_[cell / kEpochCells]; }
  std::uint64_t dependency_epoch() const { return dependency_epoch_; }

  // Calls f(cell, p) for each step of an earlier layer that step p of `cell` needs, as far as it is known.
  template <class F>
  void for_each_dependency(std::uint32_t cell, std::uint32_t p, const F& f) const {
    const std::span<const Dependency> needs = needs_[cell];
    const auto finer = [last = last_generation(cell, p)](const Dependency& d) { return d.generation > last; };
    const auto first = std::partition_point(needs.begin(), needs.end(), finer) - needs.begin();
    for_each_dependency(cell, p, needs.subspan(static_cast<std::size_t>(first)), f);
  }
  // The same, given the cell's needs without those of finer steps; those of coarser steps may lack.
  template <class F>
  void for_each_dependency(std::uint32_t cell, std::uint32_t p, std::span<const Dependency> needs, const F& f) const {
    if (p > 1) {
      f(cell, p - 1);
    } else if (parent_[cell] != kNoCell) {
      f(parent_[cell], segment_count(parent_[cell]));
    }
    const std::uint32_t before = p > 1 ? last_generation(cell, p - 1) : 0;
    for (const Dependency& need : needs) {
      if (need.generation <= before) break;
      const std::uint32_t on = step_of(need.cell, need.on);
      if (slab_of_[need.cell] < slab_of_[cell] || on < p) f(need.cell, on);
    }
  }

  static constexpr std::uint32_t kNoCell = 0xFFFFFFFFU;

 private:
  struct Slab {
    std::uint32_t first_cell = 0;
    std::uint32_t cell_count = 0;
    std::uint32_t layer_count = 0;
    std::uint32_t first_step = 0;
    std::uint32_t first_layer = 0;
    std::vector<std::uint8_t> generations;  // by layer
    std::uint32_t generation_count = 0;
    std::vector<std::uint8_t> step_of;           // by generation, from the first
    std::vector<std::uint32_t> last_generation;  // by layer
  };
  struct KeptSphere {
    glm::vec3 center{0.0F};  // from the origin
    float radius = 0.0F;
  };
  struct KeptExtent {
    KeptSphere sphere;
    glm::vec3 cone_axis{0.0F, 0.0F, 1.0F};
    float cone_cosine = -1.0F;
    std::uint32_t parts_begin = 0;
    std::uint32_t part_count = 0;
    std::uint64_t epoch = 0;
  };
  KeptSphere kept_sphere(const glm::dvec3& center, double radius) const;
  static constexpr std::uint32_t kNoExtent = 0xFFFFFFFFU;
  static constexpr std::uint32_t kEpochCells = 16;
  bool has_children(std::uint32_t cell) const { return cell + std::size_t{1} < first_child_.size(); }
  static void count_generations(Slab& slab);

  std::vector<Slab> slabs_;
  std::vector<std::uint8_t> slab_of_;
  std::vector<std::uint32_t> parent_;
  std::vector<std::uint32_t> first_child_;  // of the cells of all slabs but the last, and the end
  PagedArray<float> errors_;                // on pages that take memory only where cells are known
  NarrowCounts sizes_bytes_;
  NarrowCounts triangles_;
  std::uint64_t base_triangles_ = 0;
  std::uint64_t base_memory_bytes_ = 0;
  bool joins_generations_ = false;

  std::vector<std::uint8_t> applied_;
  std::vector<std::uint8_t> begun_;
  std::vector<std::uint8_t> held_;
  std::uint64_t begun_triangles_ = 0;
  std::uint64_t begun_bytes_ = 0;
  std::uint64_t held_bytes_ = 0;
  glm::dvec3 origin_{0.0};
  std::vector<std::uint32_t> extent_numbers_;  // by cell, into extents_
  std::vector<KeptExtent> extents_;
  std::vector<KeptSphere> parts_;  // of extents
  std::uint64_t epoch_ = 0;
  DependencyLists needs_;
  DependencyLists supports_;
  std::vector<std::uint64_t> dependency_epochs_;  // by kEpochCells cells
  std::uint64_t dependency_epoch_ = 0;
  std::vector<Dependency> scratch_;
};

}  // namespace fanstream
