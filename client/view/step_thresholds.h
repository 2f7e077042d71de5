// For every step the tolerance at which it begins to be wanted, for itself or for what depends on it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "client/view/cell_table.h"
#include "client/view/criteria.h"

namespace fanstream {

// Weight * error_px as arrays by cell, see ProjectedError; `scale` has the weight in it.
struct CellScales {
  std::vector<float> scale;
  std::vector<float> depth;
  std::vector<float> slant;
  float near = 1.0F;
  void resize(std::size_t cells);
  void set(std::uint32_t cell, const ProjectedError& error, double weight);
};

struct StepThresholds {
  std::vector<float> begun;  // by step: that its first generation is in the mesh, so that its segment must be held
  std::vector<float> whole;  // that all of it is; the same, and left empty, where no layer joins generations
};

// A step is asked for by its weighted_px before it is taken, as a whole: in its last generation. A generation's
// threshold becomes the largest of what is asked for of it and of all generations that depend on it by the table's
// rule, or 0 where that is at most `floor`. So for every t >= floor the generations above t are a closed set, the
// smallest that has all steps that are above t by themselves.
//
// One pass from fine to coarse, linear in generations, cells and dependencies: a generation is final when all finer
// ones are.
class ThresholdPass {
 public:
  void run(const CellTable& table, const CellScales& scales, float floor, StepThresholds& thresholds);

 private:
  void raise_by(const CellTable& table, std::uint32_t slab, std::uint32_t generation);
  float& at(std::uint32_t slab, std::uint32_t cell, std::uint32_t generation) {
    return generations_[rows_[first_row_[slab] + generation - 1] + cell];
  }

  std::vector<std::size_t> slab_begin_;   // into generations_
  std::vector<std::size_t> first_row_;    // by slab, into rows_
  std::vector<std::size_t> rows_;         // by generation: where in generations_ cell 0 would be
  std::vector<float> generations_;        // by slab, generation and cell
  std::vector<std::uint32_t> next_need_;  // by cell: the first of the needs that are not yet through; likewise
  std::vector<std::uint32_t> next_support_;
};

// counts[cell] becomes how many of the cell's steps have a threshold above `level`; with a `factor`, thresholds are
// multiplied by it first.
void count_steps_above(const CellTable& table, std::span<const float> thresholds, float level, float factor,
                       std::vector<std::uint8_t>& counts);

}  // namespace fanstream
