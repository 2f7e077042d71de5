#include "common/refine/unfinished_cells.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

TEST(UnfinishedCells, NoneLagsBehindWhereThereAreNone) {
  const UnfinishedCells cells;
  for (std::uint32_t g = 0; g <= kMostGenerations; ++g) EXPECT_FALSE(cells.any_before(g));
}

TEST(UnfinishedCells, TellWhetherTheFurthestBehindHasTakenAGeneration) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    testing::SeededRandom random(seed);
    UnfinishedCells cells;
    std::vector<std::uint32_t> kept;
    for (int i = 0; i < 200; ++i) {
      if (kept.empty() || random.one_in(2)) {
        kept.push_back(random.below(kMostGenerations + 1));
        cells.add(kept.back());
      } else {
        const auto gone = kept.begin() + random.below(static_cast<std::uint32_t>(kept.size()));
        cells.remove(*gone);
        kept.erase(gone);
      }
      for (std::uint32_t g = 0; g <= kMostGenerations; ++g) {
        ASSERT_EQ(cells.any_before(g), std::any_of(kept.begin(), kept.end(), [g](auto k) { return k < g; })) << g;
      }
    }
  }
}

}  // namespace
}  // namespace fanstream
