// What is computed from whole rings, eight positions at a time: the most of what decoding costs. The same text is
// compiled for machines of any kind and for those with AVX2; which of them runs is found out when it is first needed.
// Both compute the same bits (CODING.md, section 10).
#pragma once

#include <cstdint>
#include <span>

#include "common/coding/split_in_progress.h"
#include "common/coding/split_model.h"
#include "common/coding/split_prediction.h"

namespace fanstream {

// Splits that stand one after another and are of one stream.
struct DecoderRun {
  RansDecoder* decoder = nullptr;  // another than those of other runs
  std::size_t splits = 0;
};

// Thread safe. Rings are loaded before (RingGeometry::load), and measured before anything else is asked.
struct RingKernels {
  using Bits = PlainBits;
  const char* name;  // "portable" or "avx2"

  // Of one split, stage by stage, as code_splits wants them:
  // how the ring lies in space;
  void (*measure)(RingGeometry& ring, const RingPlaces& places);
  // the wings from what was coded of them, any first != last below the ring's size, whatever the bytes;
  void (*find_wings)(SplitInProgress& split);
  // in which generations both vertices may be split next;
  void (*find_free)(SplitInProgress& split, const CodingTime& time);
  // where the hidden centre is expected;
  Prediction (*predict)(const PhaseModel& model, const SplitInProgress& split);
  // and the shift of a free parent, once the displacement is known, in grid steps.
  Prediction (*predict_shift)(const PhaseModel& model, const SplitInProgress& split, Float4 displacement);

  // Of up to AxisChains::kMost predictions, of which there is at least one:
  // their chains;
  void (*chain)(std::span<const Prediction> predictions, const AxisUnits& units, AxisChains& chains);
  // how the residuals of the axis at a place in the order are coded;
  void (*choose)(const AxisChains& chains, std::size_t place, std::size_t count, ResidualChoices& choices);
  // which values lie at these distances (ResidualChoice), with room for whole blocks of eight;
  void (*to_values)(const ResidualChoices& choices, std::span<std::int32_t> distances);
  // and what the values at place 0 or 1, with such room, say of those at later ones.
  void (*learn)(AxisChains& chains, std::size_t place, std::span<const std::int32_t> values);

  // All of code_splits, for a decoder. The rings have been measured, or `places` says how.
  void (*decode)(RansDecoder& decoder, const PhaseModel& model, const AxisUnits& units, const CodingTime& time,
                 std::span<SplitInProgress> splits, const RingPlaces& places);
  // And of splits from several streams, each of them a run's.
  void (*decode_runs)(std::span<const DecoderRun> runs, const PhaseModel& model, const AxisUnits& units,
                      const CodingTime& time, std::span<SplitInProgress> splits, const RingPlaces& places);

  // Of one ring.
  // How far the arc of `length` reaches that begins at each position; there is room for whole blocks of eight.
  void (*find_reaches)(const RingGeometry& ring, std::uint32_t length, float* reaches);
  std::uint32_t (*first_of_rank)(const RingGeometry& ring, std::uint32_t length, std::uint32_t rank);
  RingFeatures (*features)(const RingGeometry& ring, const FanSplit& split);

  static const RingKernels& portable();
  static const RingKernels* avx2();  // null where the program or the machine has none
  static const RingKernels& best();
};

}  // namespace fanstream
