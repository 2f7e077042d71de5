// Learns an asset's coding statistics from the splits that are to be coded.
#pragma once

#include <vector>

#include "common/coding/split_coder.h"

namespace fanstream {

// A coder that counts symbols instead of writing them.
class CountingCoder {
 public:
  static constexpr bool kDecodes = false;
  explicit CountingCoder(const SplitModel& model) : model_(model), counts_(SymbolContexts::kTables) {}
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

// Learns prediction weights by least squares and spreads from what those leave, from a sample of the splits.
class GeometryTraining {
 public:
  explicit GeometryTraining(std::size_t split_count) : stride_(1 + split_count / kMostSamples) {}
  void observe(const RingGeometry& ring, const FanSplit& split, const glm::vec3& unit);
  void add(const GeometryTraining& other) {
    samples_.insert(samples_.end(), other.samples_.begin(), other.samples_.end());
    shifts_.insert(shifts_.end(), other.shifts_.begin(), other.shifts_.end());
  }
  // Replaces what has been seen often enough.
  void learn(SplitStatistics& statistics) const;

 private:
  static constexpr std::size_t kMostSamples = 150'000;
  struct Sample {
    RingFeatures features;
    Float4 target;
    Float4 normal;
    float mean_square;
    float bend_square;
    bool open;
  };
  struct Shift {
    Sample sample;
    Float4 shift;
  };
  void learn_shifts(FreeParentStatistics& statistics) const;
  void learn_weights(SplitStatistics& statistics) const;
  void learn_spreads(SplitStatistics& statistics) const;

  std::vector<Sample> samples_;
  std::vector<Shift> shifts_;  // of free parents
  std::size_t stride_;
  std::size_t seen_ = 0;
};

struct SplitSample {
  CountingCoder::Counts counts;
  GeometryTraining geometry;
};

// Replaces the symbol tables whose own statistics save more than they cost.
void learn_symbols(const CountingCoder::Counts& counts, SplitStatistics& statistics);

}  // namespace fanstream
