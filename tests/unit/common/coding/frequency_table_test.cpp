#include "common/coding/frequency_table.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

constexpr std::uint32_t kTotal = FrequencyTable::kTotal;

// Every slot belongs to the symbol whose range holds it; ranges follow one another without gaps.
void expect_partition(const FrequencyTable& table) {
  std::uint32_t start = 0;
  for (int s = 0; s < table.symbol_count(); ++s) {
    ASSERT_EQ(table.start(s), start);
    ASSERT_GE(table.frequency(s), 2);
    const std::uint32_t end = start + table.frequency(s);
    for (std::uint32_t slot = start; slot < end; ++slot) {
      const FrequencyTable::Found found = table.find(slot);
      ASSERT_EQ(found.symbol, s) << "slot " << slot;
      ASSERT_EQ(found.start, start) << "slot " << slot;
      ASSERT_EQ(found.frequency, end - start) << "slot " << slot;
    }
    start = end;
  }
  ASSERT_EQ(start, kTotal);
}

TEST(FrequencyTable, EverySlotFindsItsSymbol) {
  for (int symbols = 1; symbols <= FrequencyTable::kMaxSymbols; ++symbols) {
    SCOPED_TRACE(symbols);
    expect_partition(FrequencyTable(symbols));
  }
}

TEST(FrequencyTable, EverySlotFindsItsSymbolWhateverTheWeights) {
  for (std::uint64_t seed = 0; seed < 120; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    testing::SeededRandom random(seed);
    std::vector<double> weights(1 + random.below(FrequencyTable::kMaxSymbols));
    for (double& w : weights) w = random.one_in(4) ? 0.0 : std::exp(40.0 * (random.unit() - 0.5));
    expect_partition(FrequencyTable::from_weights(weights));
  }
}

TEST(FrequencyTable, ACertainSymbolLeavesRoomForAllOthers) {
  for (std::size_t certain = 0; certain < 32; ++certain) {
    std::vector<double> weights(32, 0.0);
    weights[certain] = 1.0;
    const FrequencyTable table = FrequencyTable::from_weights(weights);
    expect_partition(table);
    EXPECT_EQ(table.frequency(static_cast<int>(certain)), kTotal - 62);
  }
}

TEST(FrequencyTable, NoWeightAtAllMeansAllAlike) {
  const FrequencyTable table = FrequencyTable::from_weights(std::vector<double>(8, 0.0));
  for (int s = 0; s < 8; ++s) EXPECT_EQ(table.frequency(s), kTotal / 8);
}

TEST(FrequencyTable, FrequenciesFollowTheWeights) {
  const std::vector<double> weights{1.0, 3.0, 12.0};
  const FrequencyTable table = FrequencyTable::from_weights(weights);
  for (int s = 0; s < 3; ++s) {
    EXPECT_NEAR(table.frequency(s), weights[static_cast<std::size_t>(s)] / 16.0 * kTotal, 8.0);
    EXPECT_NEAR(table.cost_bits(s), -std::log2(weights[static_cast<std::size_t>(s)] / 16.0), 0.01);
  }
}

}  // namespace
}  // namespace fanstream
