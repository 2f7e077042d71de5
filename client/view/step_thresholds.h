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

// thresholds[step] becomes the largest weighted_px, before they are taken, of the step and of all steps that depend on
// it by the table's rule, or 0 where that is at most `floor`. So for every t >= floor the steps above t are a closed
// set, the smallest that has all steps that are above t by themselves.
//
// One pass from fine to coarse, linear in steps and neighbours: a step is final when all finer layers are done.
void compute_step_thresholds(const CellTable& table, const CellScales& scales, float floor,
                             std::vector<float>& thresholds);

// counts[cell] becomes how many of the cell's steps have a threshold above `level`; with a `factor`, thresholds are
// multiplied by it first.
void count_steps_above(const CellTable& table, std::span<const float> thresholds, float level, float factor,
                       std::vector<std::uint8_t>& counts);

}  // namespace fanstream
