#include "common/coding/diagonal_model.h"

#include <cmath>

namespace fanstream {
namespace {

constexpr std::size_t kLevels = 32;
constexpr double kToldBits = 9.0;  // what a level that is told costs

// 65536 times 2^-1, 2^-1.5, ... as whole numbers, so that tables are equal everywhere.
constexpr std::array<std::uint16_t, 16> kShares{32768, 23170, 16384, 11585, 8192, 5793, 4096, 2896,
                                                2048,  1448,  1024,  724,   512,  362,  256,  181};

std::vector<FrequencyTable> tables_by_level() {
  std::vector<FrequencyTable> tables;
  for (std::size_t level = 0; level < kLevels; ++level) {
    const double share = kShares[level % 16];
    const std::array<double, 2> weights =
        level < 16 ? std::array<double, 2>{65536.0 - share, share} : std::array<double, 2>{share, 65536.0 - share};
    tables.push_back(FrequencyTable::from_weights(weights));
  }
  return tables;
}

}  // namespace

const FrequencyTable& DiagonalStatistics::differs_table() {
  static constexpr std::array<double, 2> kWeights{7.0, 1.0};
  static const FrequencyTable table = FrequencyTable::from_weights(kWeights);
  return table;
}

const DiagonalStatistics& DiagonalStatistics::built_in() {
  static const DiagonalStatistics statistics{{12, 9,  8,  8,  12, 10, 8,  1,  0,  8,  12, 15, 24, 24, 19, 0,  24, 28,
                                              12, 15, 15, 2,  6,  3,  8,  0,  19, 12, 11, 10, 4,  5,  5,  5,  0,  19,
                                              24, 0,  2,  24, 24, 26, 24, 22, 21, 24, 0,  2,  24, 28, 27, 28, 21, 21,
                                              24, 1,  4,  24, 28, 28, 28, 21, 21, 8,  3,  3,  18, 27, 24, 28, 22, 22,
                                              8,  8,  7,  17, 0,  18, 21, 21, 21, 12, 10, 9,  0,  0,  0,  18, 21, 21}};
  return statistics;
}

DiagonalStatistics DiagonalStatistics::learn(
    const std::array<std::array<std::uint64_t, 2>, kDiagonalContexts>& counts) {
  DiagonalStatistics best = built_in();
  const std::vector<FrequencyTable> tables = tables_by_level();
  for (std::size_t c = 0; c < kDiagonalContexts; ++c) {
    const auto cost = [&](std::size_t level) {
      return static_cast<double>(counts[c][0]) * tables[level].cost_bits(0) +
             static_cast<double>(counts[c][1]) * tables[level].cost_bits(1);
    };
    double least = cost(best.levels[c]) - kToldBits;
    for (std::size_t level = 0; level < kLevels; ++level) {
      if (cost(level) >= least) continue;
      least = cost(level);
      best.levels[c] = static_cast<std::uint8_t>(level);
    }
  }
  return best;
}

DiagonalModel::DiagonalModel(const DiagonalStatistics& statistics)
    : statistics_(statistics), tables_(tables_by_level()) {}

}  // namespace fanstream
