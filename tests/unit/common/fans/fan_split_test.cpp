#include "common/fans/fan_split.h"

#include <gtest/gtest.h>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

constexpr ParentPosition kAll[] = {ParentPosition::kept, ParentPosition::middle, ParentPosition::added,
                                   ParentPosition::free};
const GridPoint kShift(-4, 11, 3);

TEST(FanSplit, PlacesAfterASplitAreThoseBeforeTheMerge) {
  for (const ParentPosition parent : kAll) {
    for (std::uint32_t generation = 0; generation < 4; ++generation) {
      for (int x = -5; x <= 5; ++x) {
        for (int y = -5; y <= 5; ++y) {
          const GridPoint kept(7, -3, 2);
          const GridPoint added = kept + GridPoint(x, y, x - y);
          const GridPoint merged = place_after_merge(kept, added, parent, generation, kShift);
          const SplitPlaces places = places_after_split(merged, parent, added - kept, generation, kShift);
          ASSERT_EQ(places.kept, kept) << static_cast<int>(parent) << " " << generation << " " << x << " " << y;
          ASSERT_EQ(places.added, added) << static_cast<int>(parent) << " " << generation << " " << x << " " << y;
        }
      }
    }
  }
}

TEST(FanSplit, AMergeTakesTheParentBackToItsPlace) {
  testing::SeededRandom random(4);
  for (int i = 0; i < 5000; ++i) {
    const auto coordinate = [&] { return random.between(-(1 << 20), 1 << 20); };
    const GridPoint parent(coordinate(), coordinate(), coordinate());
    const GridPoint displacement(coordinate(), coordinate(), coordinate());
    for (const ParentPosition position : kAll) {
      for (std::uint32_t generation = 1; generation <= 2; ++generation) {
        const SplitPlaces places = places_after_split(parent, position, displacement, generation, kShift);
        ASSERT_EQ(places.added - places.kept, displacement);
        ASSERT_EQ(place_after_merge(places.kept, places.added, position, generation, kShift), parent);
      }
    }
  }
}

TEST(FanSplit, TheMiddleOfAnOddDisplacementIsRoundedDownInEvenGenerationsAndUpInOdd) {
  EXPECT_EQ(place_after_merge({0, 0, 0}, {3, -3, 1}, ParentPosition::middle, 2), GridPoint(1, -2, 0));
  EXPECT_EQ(place_after_merge({0, 0, 0}, {3, -3, 1}, ParentPosition::middle, 1), GridPoint(2, -1, 1));
  EXPECT_EQ(halfway_offset({4, -4, 0}, 0), halfway_offset({4, -4, 0}, 1));
}

TEST(FanSplit, ParentsAtAnEndStayThere) {
  const GridPoint kept(1, 2, 3);
  const GridPoint added(4, 8, -3);
  EXPECT_EQ(place_after_merge(kept, added, ParentPosition::kept, 1), kept);
  EXPECT_EQ(place_after_merge(kept, added, ParentPosition::added, 1), added);
}

TEST(FanSplit, AFreeParentLiesItsShiftFromHalfway) {
  EXPECT_EQ(place_after_merge({0, 0, 0}, {3, -3, 1}, ParentPosition::free, 2, {10, 20, -30}), GridPoint(11, 18, -30));
  EXPECT_TRUE(is_shift({kMostShift, -kMostShift, 0}));
  EXPECT_FALSE(is_shift({kMostShift + 1, 0, 0}));
  EXPECT_FALSE(is_shift({0, 0, -kMostShift - 1}));
}

}  // namespace
}  // namespace fanstream
