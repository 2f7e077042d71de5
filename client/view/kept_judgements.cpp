#include "client/view/kept_judgements.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fanstream {
namespace {

constexpr double kMost = std::numeric_limits<float>::max();
constexpr double kRounding = 1.2e-7;  // more than twice what single precision rounds by, at most

float rounded(double value) { return static_cast<float>(std::clamp(value, -kMost, kMost)); }
float no_less(double value) { return rounded(value + std::abs(value) * kRounding); }
float no_more(double value) { return rounded(value - std::abs(value) * kRounding); }

}  // namespace

void KeptJudgements::begin(const CellJudgement& anywhere) {
  anywhere_ = anywhere;
  kept_.resize(table_.extent_count());
}

CellJudgement KeptJudgements::within_parent(std::uint32_t cell) const {
  const std::uint32_t parent = table_.parent(cell);
  if (parent == CellTable::kNoCell) return anywhere_;
  CellJudgement judgement = (*this)[parent];  // as deep as there are slabs
  judgement.weight = judgement.weight_within;
  judgement.area_px /= table_.child_count(parent);
  return judgement;
}

void KeptJudgements::set(std::uint32_t cell, const CellJudgement& judgement) {
  const ProjectedError& error = judgement.error;
  kept_[table_.extent_number(cell)] = {
      no_less(error.scale_px),          no_more(error.depth),       no_more(error.slant), rounded(judgement.weight),
      rounded(judgement.weight_within), rounded(judgement.area_px), judgement.in_frustum, judgement.facing};
}

}  // namespace fanstream
