#include "common/coding/split_model.h"

#include <algorithm>
#include <cmath>

namespace fanstream {
namespace {

#include "common/coding/default_statistics.inc"

constexpr double kHalfOctave = 0.70710678118654752440;

}  // namespace

int SymbolContexts::split_count(std::uint32_t valence, std::uint32_t age) {
  const int by_valence = valence < 3 ? 0 : valence > 14 ? 11 : static_cast<int>(valence) - 3;
  const int by_age = age < 5 ? static_cast<int>(age) : age < 7 ? 5 : age < 11 ? 6 : 7;
  return by_valence * 8 + by_age;
}

int SymbolContexts::symbol_count(int table) {
  if (table < kOpeningFirst) return 5;
  if (table < kLengthFirst) return 4;
  return table < kParentFirst ? 32 : 3;
}

int SpreadContexts::size_class(float size) {
  int exponent = 0;
  const float mantissa = std::frexp(size * size, &exponent);
  (void)mantissa;
  return std::clamp(exponent + 3, 0, kSizes - 1);
}

int SpreadContexts::normal(float bend, float mean_length) {
  const int ratio = bend * 16.0F < mean_length ? 0 : bend * 5.0F < mean_length ? 1 : 2;
  return kNormal + ratio * kSizes + size_class(bend);
}

CodedWeights coded_weights(std::span<const double> counts) {
  double sum = 0.0;
  for (const double c : counts) sum += c;
  CodedWeights coded(counts.size(), 31);
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] <= 0.0) continue;
    coded[i] = static_cast<std::uint8_t>(std::clamp(std::lround(-2.0 * std::log2(counts[i] / sum)), 0L, 31L));
  }
  return coded;
}

FrequencyTable table_of(std::span<const std::uint8_t> coded) {
  std::array<double, FrequencyTable::kMaxSymbols> weights{};
  for (std::size_t i = 0; i < coded.size(); ++i) {
    weights[i] = 1.0;
    for (int q = 0; q < coded[i]; ++q) weights[i] *= kHalfOctave;
  }
  return FrequencyTable::from_weights(std::span<const double>(weights).first(coded.size()));
}

SplitModel::SplitModel() {
  for (int t = 0; t < SymbolContexts::kTables; ++t) {
    const auto count = static_cast<std::size_t>(SymbolContexts::symbol_count(t));
    symbols[static_cast<std::size_t>(t)] =
        table_of(std::span<const std::uint8_t>(kDefaultSymbols[t]).first(count));
  }
  for (int c = 0; c < PredictionContexts::kClasses; ++c) {
    std::copy(std::begin(kDefaultWeights[c]), std::end(kDefaultWeights[c]), weights[static_cast<std::size_t>(c)].begin());
  }
  std::copy(std::begin(kDefaultSpreads), std::end(kDefaultSpreads), spreads.begin());
}

}  // namespace fanstream
