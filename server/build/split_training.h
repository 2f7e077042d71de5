// Learns an asset's coding statistics from the splits that are to be coded.
#pragma once

#include <vector>

#include "common/coding/split_coder.h"

namespace fanstream {

// A coder that counts symbols instead of writing them, by the model's tables (SplitModel::index_of).
class CountingCoder {
 public:
  static constexpr bool kDecodes = false;
  explicit CountingCoder(const SplitModel& model) : model_(model), counts_(model.table_count()) {}
  int symbol(const FrequencyTable& table, int value) {
    const std::size_t index = model_.index_of(table);
    if (index < counts_.size()) counts_[index][static_cast<std::size_t>(value)] += 1.0;
    return value;
  }
  unsigned bits(int /*count*/, unsigned value) { return value; }
  using Counts = std::vector<std::array<double, FrequencyTable::kMaxSymbols>>;
  const Counts& counts() const { return counts_; }

 private:
  const SplitModel& model_;
  Counts counts_;
};

// Of an untied model's contexts, phase by phase, to those of the tables that they share.
CountingCoder::Counts tied_counts(const CountingCoder::Counts& untied);

// Learns prediction weights by least squares, and spreads and their factors by likelihood from what those leave, from a
// sample of the splits.
class GeometryTraining {
 public:
  static constexpr std::size_t kMostSamples = 150'000;
  explicit GeometryTraining(std::size_t split_count, std::size_t most_samples = kMostSamples)
      : stride_(1 + split_count / most_samples) {}
  void observe(const RingGeometry& ring, const FanSplit& split, const glm::vec3& unit, int phase);
  // Of the other's samples at most so many, spread evenly.
  void add(const GeometryTraining& other, std::size_t most_samples);
  // Replaces what saves more bits than it takes in an asset.
  void learn(SplitStatistics& statistics) const { learn(statistics, true); }
  // Replaces whatever is better, again and again: what is to be built in.
  void learn_built_in(SplitStatistics& statistics) const;

 private:
  struct Sample {
    RingFeatures features;
    Float4 target;
    Float4 normal;
    float mean_square;
    float bend_square;
    bool open;
    std::uint8_t phase;
    std::size_t prediction() const {
      return SplitStatistics::class_of(phase, PredictionContexts::index(features.middle, open, features.arc));
    }
  };
  struct Shift {
    Sample sample;
    Float4 shift;
  };
  using Weights = std::array<std::int8_t, PredictionContexts::kFeatures>;
  // How far a sample is off its prediction along it, across it and off the plane, and the spreads that go with them.
  struct Off {
    std::array<float, 3> amounts{};
    std::array<int, 3> spreads{};
    std::size_t first = 0;  // 2 where the prediction has no direction
  };
  static Off off(const Sample& sample, const Weights& weights);
  void learn(SplitStatistics& statistics, bool at_a_price) const;
  void learn_shifts(FreeParentStatistics& statistics) const;
  void learn_weights(SplitStatistics& statistics, bool at_a_price) const;
  template <class F>
  void for_each_offset(const SplitStatistics& statistics, const F& f) const;
  void learn_spreads(SplitStatistics& statistics, bool at_a_price) const;
  void learn_scales(SplitStatistics& statistics, bool at_a_price) const;

  std::vector<Sample> samples_;
  std::vector<Shift> shifts_;  // of free parents
  std::size_t stride_;
  std::size_t seen_ = 0;
};

struct SplitSample {
  CountingCoder::Counts counts;  // of an untied model
  GeometryTraining geometry;
};

// Replaces the symbol tables whose own statistics save more than they cost. `counts` by table.
void learn_symbols(const CountingCoder::Counts& counts, SplitStatistics& statistics);

}  // namespace fanstream
