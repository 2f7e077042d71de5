// What a view makes of all cells, kept from plan to plan.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "client/view/criteria.h"

namespace fanstream {

// Judgements of one view at half their size: in single precision, errors rounded to what is no better. Thread safety:
// like a standard container.
class KeptJudgements {
 public:
  // `near`: that of all the view's judgements.
  void resize(std::size_t cells, double near) {
    cells_.resize(cells);
    near_ = near;
  }
  std::size_t size() const { return cells_.size(); }
  CellJudgement operator[](std::size_t cell) const;
  void set(std::size_t cell, const CellJudgement& judgement);

 private:
  struct Kept {
    float scale_px = 0.0F;
    float depth = 0.0F;
    float slant = 0.0F;
    float weight = 1.0F;
    float weight_within = 1.0F;
    float area_px = 0.0F;
    bool in_frustum = true;
    Facing facing = Facing::unknown;
  };
  std::vector<Kept> cells_;
  double near_ = 1.0;
};

}  // namespace fanstream
