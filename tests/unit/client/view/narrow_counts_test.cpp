#include "client/view/narrow_counts.h"

#include <gtest/gtest.h>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

TEST(NarrowCounts, HoldAnyNumberWhereverItComes) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    testing::SeededRandom random(seed);
    std::vector<std::uint32_t> expected(1 + random.below(500));
    NarrowCounts counts(expected.size());
    const std::uint32_t large_one_in = random.one_in(3) ? 1'000'000 : 300;
    for (int step = 0; step < 1000; ++step) {
      const std::uint32_t i = random.below(expected.size());
      expected[i] = random.below(random.one_in(large_one_in) ? std::size_t{1} << 32U : std::size_t{1} << 16U);
      counts.set(i, expected[i]);
      ASSERT_EQ(counts.size(), expected.size());
      ASSERT_EQ(counts[i], expected[i]);
    }
    for (std::size_t i = 0; i < expected.size(); ++i) ASSERT_EQ(counts[i], expected[i]);
  }
}

}  // namespace
}  // namespace fanstream
