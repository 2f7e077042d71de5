#include "common/refine/vertex_slots.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::SeededRandom;

TEST(VertexSlots, HandOutTheLowestFreeNumber) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const VertexId first = random.below(500);
    VertexSlots slots(first);
    std::set<VertexId> taken;
    for (int step = 0; step < 3000; ++step) {
      const bool take = taken.empty() || random.below(100) < (step / 500 % 2 == 0 ? 70U : 30U);
      if (take) {
        VertexId lowest = first;
        while (taken.contains(lowest)) ++lowest;
        const VertexId v = slots.take();
        ASSERT_EQ(v, lowest);
        taken.insert(v);
        const VertexSlots::Range group = slots.group(v);
        ASSERT_TRUE(group.first <= v && v < group.last && (group.first - first) % VertexSlots::kGroup == 0);
        const auto others = std::distance(taken.lower_bound(group.first), taken.lower_bound(group.last));
        ASSERT_EQ(slots.is_alone(v), others == 1);
      } else {
        const auto any = std::next(taken.begin(), random.below(taken.size()));
        slots.give_back(*any);
        taken.erase(any);
      }
      ASSERT_TRUE(taken.empty() || *taken.rbegin() < slots.end());
    }
  }
}

// Ranges of free groups alone, in order, and every group that became free is in one.
TEST(VertexSlots, TellWhichGroupsHaveBecomeFree) {
  std::size_t told = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    VertexSlots slots(7);
    std::set<VertexId> taken;
    for (int round = 0; round < 20; ++round) {
      for (std::uint32_t left = random.below(6000); left > 0; --left) taken.insert(slots.take());
      std::set<VertexId> emptied;  // by the group's first number
      const std::vector<VertexId> before(taken.begin(), taken.end());
      const VertexId low = 7 + random.below(slots.end());
      const VertexId high = low + random.below(4000);
      for (const VertexId v : before) {
        if (v < low || v >= high) continue;
        slots.give_back(v);
        taken.erase(v);
        const VertexSlots::Range group = slots.group(v);
        if (taken.lower_bound(group.first) == taken.lower_bound(group.last)) emptied.insert(group.first);
      }
      if (random.one_in(2) && !taken.empty()) taken.insert(slots.take());
      const std::vector<VertexSlots::Range> ranges = slots.take_emptied();
      VertexId end = 0;
      for (const VertexSlots::Range range : ranges) {
        ASSERT_LT(range.first, range.last);
        ASSERT_GE(range.first, end);
        end = range.last;
        ASSERT_EQ(taken.lower_bound(range.first), taken.lower_bound(range.last)) << "holds a number in use";
      }
      for (const VertexId first : emptied) {
        if (taken.lower_bound(first) != taken.lower_bound(first + VertexSlots::kGroup)) continue;  // taken again
        ++told;
        ASSERT_TRUE(std::any_of(
            ranges.begin(), ranges.end(),
            [&](const VertexSlots::Range& r) { return r.first <= first && first + VertexSlots::kGroup <= r.last; }))
            << "group " << first;
      }
      ASSERT_TRUE(slots.take_emptied().empty());
    }
  }
  EXPECT_GT(told, 1000U);
}

}  // namespace
}  // namespace fanstream
