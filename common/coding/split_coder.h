// FanSplits to symbols and back, given the rings of their roots. Described step by step in CODING.md.
//
// Splits are coded by batches of independent ones, stage by stage: what a decoder computes for one split then runs
// beside what it computes for the others, and only the symbols themselves have to wait for each other.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>

#include "common/coding/large_value.h"
#include "common/coding/next_split.h"
#include "common/coding/place_precision.h"
#include "common/coding/residual_tables.h"
#include "common/coding/ring_geometry.h"
#include "common/coding/split_model.h"
#include "common/coding/split_prediction.h"

namespace fanstream {

// A split on its way between values and symbols.
struct SplitInProgress {
  RingGeometry ring;  // of the root, to be assigned before
  FanSplit split;     // given to an encoder, found by a decoder; wings are ring positions
  // The generations in which root and new vertex are split next: given to an encoder, found by a decoder.
  std::uint8_t root_next = kNeverSplit;
  std::uint8_t added_next = kNeverSplit;
  // Of a vertex that is never split again, what its place has beyond the generation's lattice: likewise.
  LowBits kept_low = 0;
  LowBits added_low = 0;
  std::uint32_t length = 1;  // of the arc, in ring steps
  std::uint32_t rank = 0;    // of the arc among those of its length; on an open ring, from the gap
  Opening opening = Opening::closed;
  FreeGenerations root_free;
  FreeGenerations added_free;
  AxisChain chain;
};

// Where in the asset's generations a batch of splits stands.
struct CodingTime {
  std::uint32_t generation = 1;
  std::uint32_t last = 1;  // of the asset
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

inline const FrequencyTable& table_at(const SplitModel& model, int index) {
  return model.symbols[static_cast<std::size_t>(index)];
}

// How the ring is cut.
template <class Coder>
[[gnu::always_inline]] inline void code_arc(Coder& coder, const SplitModel& model, SplitInProgress& s) {
  const std::uint32_t size = s.ring.size();
  if (s.ring.is_open()) [[unlikely]] {
    s.opening =
        static_cast<Opening>(coder.symbol(table_at(model, SymbolContexts::opening(size)), static_cast<int>(s.opening)));
  }
  s.length =
      std::min(1 + code_large(coder, table_at(model, SymbolContexts::length(s.opening, size)), s.length - 1), size - 1);
  if (s.opening == Opening::wing) [[unlikely]] {
    s.rank = coder.bits(1, s.rank);
  } else {
    s.rank = std::min(code_large(coder, table_at(model, SymbolContexts::rank(size, s.length)), s.rank), size - 1);
  }
}

// Neither vertex can be split next when one of its neighbours is.
inline void find_free_generations(SplitInProgress& s, std::span<const FanVertex> vertices, const CodingTime& time) {
  const std::uint32_t size = s.ring.size();
  const std::uint32_t length = s.length;
  std::uint64_t added_taken = 0;
  std::uint64_t root_taken = 0;
  const auto look_at = [&](std::uint32_t i) {  // i steps after the first wing
    const VertexId neighbour = s.ring.id(s.split.first + i);
    const bool outside = neighbour == kOutside;
    const std::uint32_t next = vertices[outside ? s.split.root : neighbour].context.next;
    const std::uint64_t bit = FreeGenerations::bit(outside ? kNeverSplit : next, time.generation);
    added_taken |= bit & (std::uint64_t{0} - static_cast<std::uint64_t>(i <= length));
    root_taken |= bit & (std::uint64_t{0} - static_cast<std::uint64_t>((i >= length) | (i == 0)));
  };
  if (size <= 8) {  // without branches, which would be coin tosses
    for (std::uint32_t i = 0; i < 8; ++i) look_at(i < size ? i : 0);
  } else {
    for (std::uint32_t i = 0; i < size; ++i) look_at(i);
  }
  s.root_free = FreeGenerations(time.generation, time.last);
  s.root_free.exclude_set(root_taken);
  s.added_free = FreeGenerations(time.generation, time.last);
  s.added_free.exclude_set(added_taken | 1U);  // nor in the generation that makes it
}

// When both vertices are split next, and where the parent lay.
template <class Coder>
[[gnu::always_inline]] inline void code_next_and_parent(Coder& coder, const SplitModel& model, SplitInProgress& s,
                                                        const CodingTime& time) {
  const std::uint32_t size = s.ring.size();
  s.root_next = code_next_split(coder, model, NextSplitOf::root, size - s.length + 2, s.root_free, s.root_next);
  s.added_free.exclude(s.root_next);
  s.added_next = code_next_split(coder, model, NextSplitOf::added, s.length + 2, s.added_free, s.added_next);
  const int parent_table = SymbolContexts::parent(s.root_next != time.generation, s.ring.is_open());
  s.split.parent =
      static_cast<ParentPosition>(coder.symbol(table_at(model, parent_table), static_cast<int>(s.split.parent)));
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

// Where a free parent lay, once the displacement is known.
template <class Coder>
[[gnu::noinline]] void code_shift(Coder& coder, const SplitModel& model, const AxisUnits& units, SplitInProgress& s) {
  const RingFeatures features = ring_features(s.ring, s.split);
  const Float4 displacement = float4(glm::vec3(s.split.displacement)) * units.size;
  AxisChain chain;
  chain_axes(predict_shift(model, s.ring, features, displacement), s.ring.normal(), units, chain);
  const auto code = [&](std::size_t place) {
    std::int32_t& coordinate = (&s.split.shift.x)[chain.order[place]];
    coordinate = model.residuals.code(coder, chain.expected[place], chain.variance[place], coordinate);
    return static_cast<float>(coordinate);
  };
  chain.learn<0>(code(0));
  chain.learn<1>(code(1));
  code(2);
}

}  // namespace detail

// Codes everything of the splits but their roots and low bits. Displacements and shifts are in points of the
// generation's lattice, whose spacing is `units`. `vertices` are the mesh's as it is before all of them.
template <class Coder>
void code_splits(Coder& original, const SplitModel& model, const AxisUnits& units, std::span<const FanVertex> vertices,
                 const CodingTime& time, std::span<SplitInProgress> splits) {
  detail::FastCoder<Coder> fast(original);
  auto& coder = fast.coder;
  for (SplitInProgress& s : splits) {
    if constexpr (Coder::kDecodes) {
      s.opening = Opening::closed;
    } else {
      detail::describe_arc(s);
    }
    detail::code_arc(coder, model, s);
  }
  for (SplitInProgress& s : splits) {
    detail::find_wings(s);
    detail::find_free_generations(s, vertices, time);
  }
  for (SplitInProgress& s : splits) detail::code_next_and_parent(coder, model, s, time);
  for (SplitInProgress& s : splits) {
    chain_axes(predict(model, s.ring, ring_features(s.ring, s.split)), s.ring.normal(), units, s.chain);
  }
  for (SplitInProgress& s : splits) detail::code_axis<0>(coder, model.residuals, s);
  for (SplitInProgress& s : splits) detail::code_axis<1>(coder, model.residuals, s);
  for (SplitInProgress& s : splits) detail::code_axis<2>(coder, model.residuals, s);
  if (!model.has_free_parents) [[likely]]
    return;
  for (SplitInProgress& s : splits) {
    if (s.split.parent == ParentPosition::free) detail::code_shift(coder, model, units, s);
  }
}

}  // namespace fanstream
