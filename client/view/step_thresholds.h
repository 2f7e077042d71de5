// For every step the tolerance at which it begins to be wanted, for itself or for what depends on it.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "client/view/cell_table.h"
#include "client/view/criteria.h"

namespace fanstream {

// Weight * error_px of consecutive cells as arrays, see ProjectedError; `scale` has the weight in it.
struct CellScales {
  std::vector<float> scale;
  std::vector<float> depth;
  std::vector<float> slant;
  float near = 1.0F;
  void resize(std::size_t cells);
  void set(std::size_t i, const ProjectedError& error, double weight);
};

// Sets `scales` to those of cells [first, first + count).
using ScalesOf = std::function<void(std::uint32_t first, std::uint32_t count, CellScales& scales)>;

// Of all generations of all cells. A step is begun when its first generation is in the mesh, so that its segment must
// be held, and whole when its last one is.
struct StepThresholds {
  std::vector<float> values;  // by slab, then by generation, then by cell
  // By layer of all slabs: where in `values` cell 0 would be in the row of the layer's first generation, and of its
  // last.
  std::vector<std::uint32_t> begun_rows;
  std::vector<std::uint32_t> whole_rows;

  void resize(const CellTable& table);  // values that are new are 0
  float begun(const CellTable& table, std::uint32_t cell, std::uint32_t p) const {
    return values[begun_rows[table.layer_of(cell, p)] + cell];
  }
  float whole(const CellTable& table, std::uint32_t cell, std::uint32_t p) const {
    return values[whole_rows[table.layer_of(cell, p)] + cell];
  }
};

// A step is asked for by its weighted_px before it is taken, as a whole: in its last generation. A generation's
// threshold becomes the largest of what is asked for of it and of all generations that depend on it by the table's
// rule, or 0 where that is at most `floor`. So for every t >= floor the generations above t are a closed set, the
// smallest that has all steps that are above t by themselves.
//
// One pass from fine to coarse, linear in generations, cells and dependencies: a generation is final when all finer
// ones are. Dependencies are kept from run to run as the pass walks them, in blocks of cells; blocks of which the table
// has learnt something are packed anew.
class ThresholdPass {
 public:
  // The table must outlive the pass. Its dependencies and layers may change between runs.
  explicit ThresholdPass(const CellTable& table) : table_(table) {}
  void run(const ScalesOf& scales_of, float floor, StepThresholds& thresholds);

 private:
  // Of two generations, by their places among all: the first needs the second.
  struct Edge {
    std::uint32_t from = 0;
    std::uint32_t to = 0;
  };
  // Consecutive cells of a slab.
  struct Block {
    std::uint32_t slab = 0;
    std::uint32_t first_cell = 0;
    std::uint32_t cell_count = 0;
    std::vector<Edge> edges;              // by falling generation
    std::vector<std::uint32_t> edge_end;  // by generation, from the first: where its edges end, which begin where those
                                          // of the next end; then 0
  };
  void place_generations();
  void pack_changed();
  void pack(Block& block);
  void raise_by(std::uint32_t slab, std::uint32_t generation, float* thresholds) const;
  std::uint32_t place(std::uint32_t slab, std::uint32_t cell, std::uint32_t generation) const {
    return rows_[first_row_[slab] + generation - 1] + cell;
  }

  const CellTable& table_;
  CellScales scales_;                       // scratch
  std::vector<std::uint32_t> first_row_;    // by slab, into rows_
  std::vector<std::uint32_t> rows_;         // by slab and generation: where cell 0 would be
  std::vector<std::uint32_t> rows_before_;  // scratch
  std::vector<Block> blocks_;
  std::vector<std::uint32_t> first_block_;  // by slab, and the end
  std::uint64_t packed_epoch_ = 0;          // the table's dependencies that the blocks have
};

// counts[cell] becomes how many of the cell's steps have a threshold above `level`; with a `factor`, thresholds are
// multiplied by it first. `rows`: begun_rows or whole_rows.
void count_steps_above(const CellTable& table, const StepThresholds& thresholds, std::span<const std::uint32_t> rows,
                       float level, float factor, std::vector<std::uint8_t>& counts);

}  // namespace fanstream
