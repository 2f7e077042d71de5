#include "client/view/dependency_lists.h"

#include <gtest/gtest.h>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::SeededRandom;

TEST(DependencyLists, EachCellHasWhatItWasGivenLast) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const std::uint32_t cells = 1 + random.below(200);
    DependencyLists lists(cells);
    std::vector<std::vector<Dependency>> expected(cells);
    for (int change = 0; change < 400; ++change) {
      const std::uint32_t cell = random.below(cells);
      expected[cell].clear();
      for (std::uint32_t left = random.below(6); left > 0; --left)
        expected[cell].push_back({1 + random.below(255), random.below(1U << 24U), random.below(1000)});
      lists.set(cell, expected[cell]);
      for (std::uint32_t c = 0; c < cells; ++c) {
        ASSERT_TRUE(std::equal(lists[c].begin(), lists[c].end(), expected[c].begin(), expected[c].end()))
            << "cell " << c << " after change " << change << " of cell " << cell;
      }
    }
  }
}

}  // namespace
}  // namespace fanstream
