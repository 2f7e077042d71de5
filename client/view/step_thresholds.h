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

// A step's threshold becomes the largest weighted_px, before they are taken, of the step and of all steps that depend
// on it by the table's rule or have been applied on top of it, or 0 where that is at most `floor`. So for every t >= floor what is above t is a closed
// set, the smallest that has, as a whole, all steps that are above t by themselves.
//
// One pass from fine to coarse, linear in generations, cells and neighbours: a step is final when all finer ones are.
class ThresholdPass {
 public:
  void run(const CellTable& table, const CellScales& scales, float floor, StepThresholds& thresholds);

 private:
  std::vector<float> before_;
};

// counts[cell] becomes how many of the cell's steps have a threshold above `level`; with a `factor`, thresholds are
// multiplied by it first.
void count_steps_above(const CellTable& table, std::span<const float> thresholds, float level, float factor,
                       std::vector<std::uint8_t>& counts);

}  // namespace fanstream
