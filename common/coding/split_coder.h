// FanSplits to symbols and back, given the rings of their roots. Described step by step in CODING.md.
//
// Splits are coded by batches of independent ones, stage by stage: what a decoder computes for one split then runs
// beside what it computes for the others, and only the symbols themselves have to wait for each other.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>

#include "common/coding/residual_tables.h"
#include "common/coding/ring_geometry.h"
#include "common/coding/split_model.h"
#include "common/coding/split_prediction.h"

namespace fanstream {

// A split on its way between values and symbols.
struct SplitInProgress {
  RingGeometry ring;           // of the root, to be assigned before
  FanSplit split;              // given to an encoder, found by a decoder; wings are ring positions
  bool last_of_patch = false;  // the root has no more splits in this generation
  std::uint32_t length = 1;    // of the arc, in ring steps
  std::uint32_t rank = 0;      // of the arc among those of its length; on an open ring, from the gap
  Opening opening = Opening::closed;
  AxisChain chain;
};

namespace detail {

// A decoder's state is worked on in registers; an encoder is used in place.
template <class Coder, bool decodes = Coder::kDecodes>
struct FastCoder {
  Coder& coder;
  explicit FastCoder(Coder& original) : coder(original) {}
};
template <class Coder>
struct FastCoder<Coder, true> {
  Coder& original;
  Coder coder;
  explicit FastCoder(Coder& given) : original(given), coder(given) {}
  ~FastCoder() { original = coder; }
  FastCoder(const FastCoder&) = delete;
  FastCoder& operator=(const FastCoder&) = delete;
};

// Values 0.. with an escape at the table's last symbol.
template <class Coder>
[[gnu::always_inline]] inline std::uint32_t code_large(Coder& coder, const FrequencyTable& table, std::uint32_t value) {
  const auto escape = static_cast<std::uint32_t>(table.symbol_count() - 1);
  const auto symbol = static_cast<std::uint32_t>(coder.symbol(table, static_cast<int>(std::min(value, escape))));
  if (symbol < escape) [[likely]]
    return symbol;
  const unsigned rest = value - escape;
  const unsigned high = coder.bits(12, rest >> 12U);
  return escape + (high << 12U) + coder.bits(12, rest & 0xFFFU);
}

inline Opening opening_of(const RingGeometry& ring, std::uint32_t first, std::uint32_t last) {
  if (!ring.is_open()) return Opening::closed;
  if (ring.gap() == first || ring.gap() == last) return Opening::wing;
  return ring.steps(first, ring.gap()) < ring.steps(first, last) ? Opening::taken : Opening::left;
}

// What an encoder knows of the arc before it is coded.
inline void describe_arc(SplitInProgress& s) {
  s.opening = opening_of(s.ring, s.split.first, s.split.last);
  s.length = s.ring.steps(s.split.first, s.split.last);
  if (s.opening == Opening::closed) s.rank = s.ring.rank_of_first(s.length, s.split.first);
  if (s.opening == Opening::wing) s.rank = s.split.first == s.ring.gap() ? 1 : 0;
  if (s.opening == Opening::taken || s.opening == Opening::left) s.rank = s.ring.steps(s.ring.gap(), s.split.first);
}

// The wings from what was coded of them: any first != last below the ring's size, whatever the bytes.
inline void find_wings(SplitInProgress& s) {
  const RingGeometry& ring = s.ring;
  if (s.opening == Opening::closed) {
    s.split.first = ring.first_of_rank(s.length, s.rank);
  } else if (s.opening == Opening::wing) {
    s.split.first = s.rank != 0 ? ring.gap() : ring.wrap(ring.gap() + ring.size() - s.length);
  } else {
    s.split.first = ring.wrap(ring.gap() + s.rank);
  }
  s.split.last = ring.wrap(s.split.first + s.length);
}

// How the ring is cut, and where the parent lay.
template <class Coder>
[[gnu::always_inline]] inline void code_shape(Coder& coder, const SplitModel& model, SplitInProgress& s) {
  const std::uint32_t size = s.ring.size();
  const auto table = [&model](int index) -> const FrequencyTable& {
    return model.symbols[static_cast<std::size_t>(index)];
  };
  if (s.ring.is_open()) [[unlikely]] {
    s.opening = static_cast<Opening>(coder.symbol(table(SymbolContexts::opening(size)), static_cast<int>(s.opening)));
  }
  s.length = std::min(1 + code_large(coder, table(SymbolContexts::length(s.opening, size)), s.length - 1), size - 1);
  if (s.opening == Opening::wing) [[unlikely]] {
    s.rank = coder.bits(1, s.rank);
  } else {
    s.rank = std::min(code_large(coder, table(SymbolContexts::rank(size, s.length)), s.rank), size - 1);
  }
  const int parent_table = SymbolContexts::parent(s.last_of_patch, s.ring.is_open());
  s.split.parent = static_cast<ParentPosition>(coder.symbol(table(parent_table), static_cast<int>(s.split.parent)));
}

// One axis of the displacement, the axes in the order of the chain; where the kept centre is hidden, the vector to it
// is coded.
template <std::size_t place, class Coder>
[[gnu::always_inline]] inline void code_axis(Coder& coder, const ResidualTables& tables, SplitInProgress& s) {
  AxisChain& chain = s.chain;
  std::int32_t& coordinate = (&s.split.displacement.x)[chain.order[place]];
  const int sign = s.split.parent == ParentPosition::added ? -1 : 1;
  const std::int32_t value = tables.code(coder, chain.expected[place], chain.variance[place], sign * coordinate);
  coordinate = sign * value;
  chain.learn<place>(static_cast<float>(value));
}

}  // namespace detail

// Codes everything of the splits but their roots.
template <class Coder>
void code_splits(Coder& original, const SplitModel& model, const AxisUnits& units, std::span<SplitInProgress> splits) {
  detail::FastCoder<Coder> fast(original);
  auto& coder = fast.coder;
  for (SplitInProgress& s : splits) {
    if constexpr (Coder::kDecodes) {
      s.opening = Opening::closed;
    } else {
      detail::describe_arc(s);
    }
    detail::code_shape(coder, model, s);
  }
  for (SplitInProgress& s : splits) {
    detail::find_wings(s);
    chain_axes(predict(model, s.ring, ring_features(s.ring, s.split)), s.ring.normal(), units, s.chain);
  }
  for (SplitInProgress& s : splits) detail::code_axis<0>(coder, model.residuals, s);
  for (SplitInProgress& s : splits) detail::code_axis<1>(coder, model.residuals, s);
  for (SplitInProgress& s : splits) detail::code_axis<2>(coder, model.residuals, s);
}

}  // namespace fanstream
