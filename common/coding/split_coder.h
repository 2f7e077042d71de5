// One FanSplit to symbols and back, given the canonical ring of its root. Described step by step in CODING.md.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "common/coding/residual_tables.h"
#include "common/coding/ring_geometry.h"
#include "common/coding/split_model.h"

namespace fanstream {

// What prediction and spreads are computed from, once the arc and the parent's position are known.
struct RingFeatures {
  bool middle = false;                        // the displacement itself is predicted, not the hidden centre's place
  std::uint32_t arc = 1;                      // ring steps on the hidden centre's side
  std::array<Float4, PredictionContexts::kFeatures> features{};
};

// Means of the spokes inside the hidden centre's arc, of the wings, inside the other arc, and at the ends of its own.
// The hidden centre is the one that is not where the parent was.
RingFeatures ring_features(const RingGeometry& ring, const FanSplit& split);

// The predicted vector and the frame of its error, in grid steps.
struct Prediction {
  Float4 mean{};
  Float4 along{};  // unit length, in the tangent plane
  float spread_along = 1.0F;
  float spread_across = 1.0F;
  float spread_normal = 1.0F;
};
Prediction predict(const SplitModel& model, const RingGeometry& ring, const RingFeatures& features);

// The covariance of the error in code steps and what each axis, in coding order, expects of the next.
struct AxisChain {
  std::array<int, 3> order{};           // the axis closest to the normal comes last
  Float4 mean{};                        // code steps, by axis
  std::array<float, 3> spread{};        // by place in the order
  float second_from_first = 0.0F;       // regression on the errors before
  float third_from_first = 0.0F;
  float third_from_second = 0.0F;
};
AxisChain chain_axes(const Prediction& prediction, Float4 normal, const glm::vec3& unit);

namespace detail {

// Values 0.. with an escape at the table's last symbol.
template <class Coder>
std::uint32_t code_large(Coder& coder, const FrequencyTable& table, std::uint32_t value) {
  const auto escape = static_cast<std::uint32_t>(table.symbol_count() - 1);
  const auto symbol = static_cast<std::uint32_t>(coder.symbol(table, static_cast<int>(std::min(value, escape))));
  if (symbol < escape) return symbol;
  const unsigned rest = value - escape;
  const unsigned high = coder.bits(12, rest >> 12U);
  return escape + (high << 12U) + coder.bits(12, rest & 0xFFFU);
}

inline Opening opening_of(const RingGeometry& ring, std::uint32_t first, std::uint32_t last) {
  if (!ring.is_open()) return Opening::closed;
  if (ring.gap() == first || ring.gap() == last) return Opening::wing;
  const std::uint32_t size = ring.size();
  return (ring.gap() + size - first) % size < (last + size - first) % size ? Opening::taken : Opening::left;
}

}  // namespace detail

// Ring positions of the wings. Decoding yields any first != last below the ring's size, whatever the bytes.
template <class Coder>
void code_arc(Coder& coder, const SplitModel& model, const RingGeometry& ring, FanSplit& split) {
  const std::uint32_t size = ring.size();
  Opening opening = Opening::closed;
  if (ring.is_open()) {
    if constexpr (!Coder::kDecodes) opening = detail::opening_of(ring, split.first, split.last);
    const FrequencyTable& table = model.symbols[static_cast<std::size_t>(SymbolContexts::opening(size))];
    opening = static_cast<Opening>(coder.symbol(table, static_cast<int>(opening)));
  }
  std::uint32_t length = (split.last + size - split.first) % size;
  const std::size_t length_table = static_cast<std::size_t>(SymbolContexts::length(opening, size));
  length = 1 + detail::code_large(coder, model.symbols[length_table], length - 1);
  length = std::min(length, size - 1);
  std::uint32_t first = split.first;
  if (opening == Opening::wing) {
    first = coder.bits(1, first == ring.gap() ? 1U : 0U) != 0U ? ring.gap() : (ring.gap() + size - length) % size;
  } else {
    const FrequencyTable& table = model.symbols[static_cast<std::size_t>(SymbolContexts::rank(size, length))];
    std::uint32_t rank = 0;
    if (opening == Opening::closed) {
      if constexpr (!Coder::kDecodes) rank = ring.rank_of_first(length, first);
      rank = std::min(detail::code_large(coder, table, rank), size - 1);
      first = ring.first_of_rank(length, rank);
    } else {
      rank = std::min(detail::code_large(coder, table, (first + size - ring.gap()) % size), size - 1);
      first = (ring.gap() + rank) % size;
    }
  }
  split.first = first;
  split.last = (first + length) % size;
}

template <class Coder>
void code_displacement(Coder& coder, const SplitModel& model, const RingGeometry& ring, const glm::vec3& unit,
                       FanSplit& split) {
  const RingFeatures features = ring_features(ring, split);
  const AxisChain chain = chain_axes(predict(model, ring, features), ring.normal(), unit);
  // Where the kept centre is hidden, the vector to it is what is predicted.
  const int sign = split.parent == ParentPosition::added ? -1 : 1;
  const ResidualTables& tables = ResidualTables::instance();
  std::array<float, 3> error{};
  for (std::size_t i = 0; i < 3; ++i) {
    const int axis = chain.order[i];
    float mean = chain.mean[axis];
    if (i == 1) mean += chain.second_from_first * error[0];
    if (i == 2) mean += chain.third_from_first * error[0] + chain.third_from_second * error[1];
    const std::int32_t value = tables.code(coder, mean, chain.spread[i], sign * split.displacement[axis]);
    split.displacement[axis] = sign * value;
    error[i] = static_cast<float>(value) - chain.mean[axis];
  }
}

// Everything of a split but its root. `last_of_patch`: the root has no more splits in this generation.
template <class Coder>
void code_split(Coder& coder, const SplitModel& model, const RingGeometry& ring, const glm::vec3& unit,
                bool last_of_patch, FanSplit& split) {
  code_arc(coder, model, ring, split);
  const int parent_table = SymbolContexts::parent(last_of_patch, ring.is_open());
  split.parent = static_cast<ParentPosition>(
      coder.symbol(model.symbols[static_cast<std::size_t>(parent_table)], static_cast<int>(split.parent)));
  code_displacement(coder, model, ring, unit, split);
}

}  // namespace fanstream
