#include "protocol/runs.h"

#include <gtest/gtest.h>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

std::vector<CellRun> joined(const std::vector<std::vector<CellRun>>& lists) {
  std::vector<CellRun> all;
  for (const std::vector<CellRun>& list : lists) all.insert(all.end(), list.begin(), list.end());
  return all;
}

TEST(SplitRuns, GivesTheSameRunsInListsThatFit) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    testing::SeededRandom random(seed);
    std::vector<CellRun> runs;
    // From small steps, of which very many fit into a list's bytes, to the largest numbers there are.
    const std::uint64_t far = seed % 2 == 0 ? kMaxCells - 10 : 60;
    for (int i = 0; i < 200'000; ++i) {
      const bool all = random.one_in(9);
      runs.push_back({static_cast<std::uint32_t>(random.below(far)), static_cast<std::uint32_t>(1 + random.below(10)),
                      all ? kAllSegments : static_cast<std::uint32_t>(random.below(seed % 4 == 0 ? 65'536 : 4))});
    }
    ASSERT_TRUE(check_each_run(runs));
    ASSERT_FALSE(check_runs(runs));
    const std::vector<std::vector<CellRun>> lists = split_runs(runs);
    EXPECT_EQ(joined(lists), runs);
    std::size_t small = 0;
    for (const std::vector<CellRun>& list : lists) {
      const Result<void> fits = check_runs(list);
      EXPECT_TRUE(fits) << fits.error().message;
      small += list.size() < 20'000 ? 1 : 0;
    }
    EXPECT_LE(small, 1U) << "no more lists than it takes";
  }
}

TEST(SplitRuns, CountsCellsToo) {
  const std::vector<CellRun> runs(40, CellRun{0, kMaxCells, 1});
  const std::vector<std::vector<CellRun>> lists = split_runs(runs);
  EXPECT_EQ(lists.size(), 3U);
  EXPECT_EQ(joined(lists), runs);
  for (const std::vector<CellRun>& list : lists) EXPECT_TRUE(check_runs(list));
}

TEST(SplitRuns, OfNothingIsNothing) { EXPECT_TRUE(split_runs({}).empty()); }

}  // namespace
}  // namespace fanstream
