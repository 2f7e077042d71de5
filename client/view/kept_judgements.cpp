#include "client/view/kept_judgements.h"

#include <algorithm>
#include <cmath>

namespace fanstream {
namespace {

constexpr float kMost = std::numeric_limits<float>::max();

float rounded(double value) { return static_cast<float>(std::clamp<double>(value, -kMost, kMost)); }

float no_less(double value) {
  const float near_by = rounded(value);
  return near_by < value ? std::nextafter(near_by, kMost) : near_by;
}

float no_more(double value) {
  const float near_by = rounded(value);
  return near_by > value ? std::nextafter(near_by, -kMost) : near_by;
}

}  // namespace

CellJudgement KeptJudgements::operator[](std::size_t cell) const {
  const Kept& kept = cells_[cell];
  return {{kept.scale_px, kept.depth, kept.slant, near_},
          kept.weight,
          kept.weight_within,
          kept.area_px,
          kept.in_frustum,
          kept.facing};
}

void KeptJudgements::set(std::size_t cell, const CellJudgement& judgement) {
  const ProjectedError& error = judgement.error;
  cells_[cell] = {
      no_less(error.scale_px),          no_more(error.depth),       no_more(error.slant), rounded(judgement.weight),
      rounded(judgement.weight_within), rounded(judgement.area_px), judgement.in_frustum, judgement.facing};
}

}  // namespace fanstream
