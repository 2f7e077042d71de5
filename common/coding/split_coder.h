// FanSplits to symbols and back, given the rings of their roots. Described step by step in CODING.md.
//
// Splits are coded by batches of independent ones, stage by stage: what a decoder computes for one split then runs
// beside what it computes for the others, and only the symbols themselves have to wait for each other.
#pragma once

#include <algorithm>
#include <span>
#include <type_traits>

#include "common/coding/large_value.h"
#include "common/coding/next_split.h"
#include "common/coding/residual_tables.h"
#include "common/coding/ring_kernels.h"

namespace fanstream {

namespace detail {

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

inline const FrequencyTable& table_at(const PhaseModel& model, int index) {
  return model.table(static_cast<std::size_t>(index));
}

// Who codes which splits: one coder all of them, or each run's stream its own. for_each(count, code) calls
// code(split, coder) for the splits of a batch in order.
template <class Coder>
struct OneCoder {
  static constexpr bool kDecodes = Coder::kDecodes;
  Coder& coder;
  template <class Code>
  [[gnu::always_inline]] void for_each(std::size_t count, Code&& code) const {
    auto&& fast = fast_coder(coder);
    for (std::size_t i = 0; i < count; ++i) code(i, fast);
  }
};
struct DecodersByRun {
  static constexpr bool kDecodes = true;
  std::span<const DecoderRun> runs;
  template <class Code>
  [[gnu::always_inline]] void for_each(std::size_t /*count*/, Code&& code) const {
    std::size_t i = 0;
    for (const DecoderRun& run : runs) {
      FastRansDecoder fast(*run.decoder);
      for (const std::size_t end = i + run.splits; i < end; ++i) code(i, fast);
    }
  }
};

// How long the arc is.
template <class Coder>
[[gnu::always_inline]] inline void code_length(Coder& coder, const PhaseModel& model, SplitInProgress& s) {
  const std::uint32_t size = s.ring.size();
  if (s.ring.is_open()) [[unlikely]] {
    s.opening =
        static_cast<Opening>(coder.symbol(table_at(model, SymbolContexts::opening(size)), static_cast<int>(s.opening)));
  }
  s.length =
      std::min(1 + code_large(coder, table_at(model, SymbolContexts::length(s.opening, size)), s.length - 1), size - 1);
}

// And which of that length it is.
template <class Coder>
[[gnu::always_inline]] inline void code_rank(Coder& coder, const PhaseModel& model, SplitInProgress& s) {
  const std::uint32_t size = s.ring.size();
  if (s.opening == Opening::wing) [[unlikely]] {
    s.rank = coder.bits(1, s.rank);
  } else {
    s.rank = std::min(code_large(coder, table_at(model, SymbolContexts::rank(size, s.length)), s.rank), size - 1);
  }
}

// When the root is split next.
template <class Bits, class Coder>
[[gnu::always_inline]] inline void code_root_next(Coder& coder, const PhaseModel& model, SplitInProgress& s) {
  const std::uint32_t valence = s.ring.size() - s.length + 2;
  s.root_next = code_next_split<Bits>(coder, model, NextSplitOf::root, valence, s.root_free, s.root_next);
  s.added_free.exclude(s.root_next);
}

// And where the parent lay.
template <class Coder>
[[gnu::always_inline]] inline void code_parent(Coder& coder, const PhaseModel& model, const CodingTime& time,
                                               SplitInProgress& s) {
  const int table = SymbolContexts::parent(s.root_next != time.generation, s.ring.is_open());
  s.split.parent = static_cast<ParentPosition>(coder.symbol(table_at(model, table), static_cast<int>(s.split.parent)));
}

// Vectors given by an encoder, found by a decoder: axis by axis of all of them, in the order of their chains.
template <class Coders, class Stages>
[[gnu::always_inline]] inline void code_vectors(const Coders& coders, const ResidualTables& tables,
                                                const Stages& stages, AxisChains& chains,
                                                std::span<GridPoint> vectors) {
  const std::size_t count = vectors.size();
  ResidualChoices choices;
  alignas(32) std::array<std::array<std::int32_t, AxisChains::kMost>, 3> values;
  for (std::size_t place = 0; place < 3; ++place) {
    stages.choose(chains, place, count, choices);
    const std::span<std::int32_t> at_place = std::span(values[place]).first(count);
    coders.for_each(
        count, [&](std::size_t i, auto& coder) __attribute__((always_inline)) {
          std::int32_t distance = 0;
          if constexpr (!Coders::kDecodes) distance = choices[i].distance_of((&vectors[i].x)[chains.order(i)[place]]);
          at_place[i] = tables.code_distance(coder, choices[i], distance);
        });
    stages.to_values(choices, at_place);
    if (place < 2) stages.learn(chains, place, at_place);
  }
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t place = 0; place < 3; ++place) (&vectors[i].x)[chains.order(i)[place]] = values[place][i];
  }
}

// The displacements; where the kept centre is hidden, the vector to it is coded.
template <class Coders, class Stages>
[[gnu::always_inline]] inline void code_displacements(const Coders& coders, const PhaseModel& model,
                                                      const Stages& stages, AxisChains& chains,
                                                      std::span<SplitInProgress> splits) {
  std::array<GridPoint, AxisChains::kMost> vectors;
  const auto sign = [](const SplitInProgress& s) { return s.split.parent == ParentPosition::added ? -1 : 1; };
  if constexpr (!Coders::kDecodes) {
    for (std::size_t i = 0; i < splits.size(); ++i) vectors[i] = sign(splits[i]) * splits[i].split.displacement;
  }
  code_vectors(coders, model.residuals, stages, chains, std::span(vectors).first(splits.size()));
  for (std::size_t i = 0; i < splits.size(); ++i) splits[i].split.displacement = sign(splits[i]) * vectors[i];
}

// Where a free parent lay, once the displacement is known.
template <class Coder, class Stages>
[[gnu::noinline]] void code_shift(Coder& coder, const PhaseModel& model, const AxisUnits& units, const Stages& stages,
                                  SplitInProgress& s) {
  const Float4 displacement = float4(glm::vec3(s.split.displacement)) * units.size;
  const Prediction prediction = stages.predict_shift(model, s, displacement);
  AxisChains chains;
  stages.chain(std::span(&prediction, 1), units, chains);
  code_vectors(OneCoder<Coder>{coder}, model.residuals, stages, chains, std::span(&s.split.shift, 1));
}

// All of it. Stages are RingKernels, or what they are made of. In every loop each symbol only waits for the one before
// it: what is computed of one split runs while the next one's symbol is looked up.
template <class Coders, class Stages>
[[gnu::always_inline]] inline void code_by_stages(const Coders& coders, const PhaseModel& model, const AxisUnits& units,
                                                  const CodingTime& time, std::span<SplitInProgress> splits,
                                                  const RingPlaces& places, const Stages& stages) {
  using Bits = typename Stages::Bits;
  const std::size_t count = splits.size();
  coders.for_each(
      count, [&](std::size_t i, auto& coder) __attribute__((always_inline)) {
        SplitInProgress& s = splits[i];
        if constexpr (Coders::kDecodes) {
          if (places.vertices != nullptr) stages.measure_spokes(s.ring, places);
          s.opening = Opening::closed;
        } else {
          describe_arc(s);
        }
        code_length(coder, model, s);
      });
  coders.for_each(
      count, [&](std::size_t i, auto& coder) __attribute__((always_inline)) {
        code_rank(coder, model, splits[i]);
        stages.find_wings(splits[i]);
      });
  coders.for_each(
      count, [&](std::size_t i, auto& coder) __attribute__((always_inline)) {
        stages.find_free(splits[i], time);
        code_root_next<Bits>(coder, model, splits[i]);
      });
  coders.for_each(
      count, [&](std::size_t i, auto& coder) __attribute__((always_inline)) {
        SplitInProgress& s = splits[i];
        if constexpr (Coders::kDecodes) {
          if (places.vertices != nullptr) stages.measure_bend(s.ring);
        }
        s.added_next =
            code_next_split<Bits>(coder, model, NextSplitOf::added, s.length + 2, s.added_free, s.added_next);
      });
  std::array<Prediction, AxisChains::kMost> predictions;
  coders.for_each(
      count, [&](std::size_t i, auto& coder) __attribute__((always_inline)) {
        code_parent(coder, model, time, splits[i]);
        predictions[i] = stages.predict(model, splits[i]);
      });
  AxisChains chains;
  stages.chain(std::span(predictions).first(splits.size()), units, chains);
  code_displacements(coders, model, stages, chains, splits);
  if (!model.has_free_parents) [[likely]]
    return;
  coders.for_each(count, [&](std::size_t i, auto& coder) {
    SplitInProgress& s = splits[i];
    if (s.split.parent != ParentPosition::free) return;
    code_aside(coder, [&](auto& reader) {
      code_shift(reader, model, units, stages, s);
      return true;
    });
  });
}

}  // namespace detail

// Codes everything of up to AxisChains::kMost splits but their roots and low bits. Displacements and shifts are in
// points of the generation's lattice, whose spacing is `units`. The rings have been loaded in the mesh as it is before
// all of the splits; an encoder's have been measured, too, and so have a
// decoder's without `places`; else it does that itself.
template <class Coder>
void code_splits(Coder& coder, const SplitModel& model, const AxisUnits& units, const CodingTime& time,
                 std::span<SplitInProgress> splits, const RingPlaces& places = {},
                 const RingKernels& kernels = RingKernels::best()) {
  const PhaseModel& phase = model.at(time.generation, time.last);
  if constexpr (std::is_same_v<Coder, RansDecoder>) {
    kernels.decode(coder, phase, units, time, splits, places);
  } else {
    detail::code_by_stages(detail::OneCoder<Coder>{coder}, phase, units, time, splits, places, kernels);
  }
}

// The same for a decoder of splits from several streams: those of the first run's, then those of the second's, and so
// on; all of them together are no more than before, and of one generation. What is found is what code_splits finds run
// by run.
inline void decode_splits(std::span<const DecoderRun> runs, const SplitModel& model, const AxisUnits& units,
                          const CodingTime& time, std::span<SplitInProgress> splits, const RingPlaces& places = {},
                          const RingKernels& kernels = RingKernels::best()) {
  const PhaseModel& phase = model.at(time.generation, time.last);
  if (runs.size() == 1) {
    kernels.decode(*runs.front().decoder, phase, units, time, splits, places);
  } else {
    kernels.decode_runs(runs, phase, units, time, splits, places);
  }
}

}  // namespace fanstream
