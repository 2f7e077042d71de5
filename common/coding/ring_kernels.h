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

  // Of several splits, stage by stage, as code_splits wants them:
  // how their rings lie in space, `vertices` being the mesh's by number;
  void (*measure)(std::span<SplitInProgress> splits, const FanVertex* vertices, Float4 unit);
  // the wings from what was coded of them, any first != last below the ring's size, whatever the bytes; and in which
  // generations both vertices may be split next;
  void (*cut)(std::span<SplitInProgress> splits, const CodingTime& time);
  // where the hidden centre is expected. Up to AxisChains::kMost splits.
  void (*predict)(std::span<SplitInProgress> splits, const PhaseModel& model, const AxisUnits& units,
                  AxisChains& chains);

  // Of up to AxisChains::kMost predictions, of which there is at least one:
  // their chains;
  void (*chain)(std::span<const Prediction> predictions, const AxisUnits& units, AxisChains& chains);
  // how the residuals of the axis at a place in the order are coded;
  void (*choose)(const AxisChains& chains, std::size_t place, std::size_t count, ResidualChoices& choices);
  // and what the values at place 0 or 1, with room for whole blocks of eight, say of those at later ones.
  void (*learn)(AxisChains& chains, std::size_t place, std::span<const std::int32_t> values);

  // All of code_splits, for a decoder.
  void (*decode)(RansDecoder& decoder, const PhaseModel& model, const AxisUnits& units, const CodingTime& time,
                 std::span<SplitInProgress> splits);
  // And of splits from several streams, each of them a run's.
  void (*decode_runs)(std::span<const DecoderRun> runs, const PhaseModel& model, const AxisUnits& units,
                      const CodingTime& time, std::span<SplitInProgress> splits);

  // Of one ring.
  void (*measure_ring)(RingGeometry& ring, const FanVertex* vertices, Float4 unit);
  // How far the arc of `length` reaches that begins at each position; there is room for whole blocks of eight.
  void (*find_reaches)(const RingGeometry& ring, std::uint32_t length, float* reaches);
  std::uint32_t (*first_of_rank)(const RingGeometry& ring, std::uint32_t length, std::uint32_t rank);
  RingFeatures (*features)(const RingGeometry& ring, const FanSplit& split);

  static const RingKernels& portable();
  static const RingKernels* avx2();  // null where the program or the machine has none
  static const RingKernels& best();
};

}  // namespace fanstream
