#include "client/view/budget_cut.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::SeededRandom;

TEST(BudgetCut, FindsTheLowestLevelThatFits) {
  BudgetCut cut;
  for (std::uint64_t seed = 1; seed <= 2000; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    cut.clear();
    std::vector<std::pair<float, std::uint64_t>> things;
    const std::size_t count = random.below(60);
    const double spread = random.one_in(2) ? 0.01 : 20.0;  // all in a bucket, or far apart
    std::uint64_t total = 0;
    for (std::size_t i = 0; i < count; ++i) {
      float level = static_cast<float>(std::exp(spread * (random.unit() - 0.5)));
      if (i > 0 && random.one_in(4)) level = things[random.below(i)].first;
      things.emplace_back(level, random.below(seed % 2 == 0 ? 1000 : 4));
      cut.add(things.back().first, things.back().second);
      total += things.back().second;
    }
    ASSERT_EQ(cut.total_cost(), total);
    const auto cost_above = [&](float level) {
      std::uint64_t sum = 0;
      for (const auto& [at, cost] : things) sum += at > level ? cost : 0;
      return sum;
    };
    const std::uint64_t room = random.below(total + 10);
    float expected = 0.0F;
    if (total > room) {
      expected = INFINITY;
      for (const auto& [at, cost] : things) {
        if (cost_above(at) <= room) expected = std::min(expected, at);
      }
    }
    ASSERT_EQ(cut.lowest_level(room), expected);
  }
}

}  // namespace
}  // namespace fanstream
