#include "common/fans/face_rooms.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::SeededRandom;

TEST(FaceRooms, AreNeverGivenOutTwiceAndFillPages) {
  SeededRandom random(7);
  FaceRooms rooms;
  std::set<std::uint32_t> taken;
  std::size_t most = 0;
  for (int step = 0; step < 20'000; ++step) {
    const bool grows = step / 1000 % 2 == 0;
    if (taken.empty() || random.below(10) < (grows ? 7U : 3U)) {
      const auto [room, opens_page] = rooms.take();
      const auto other = taken.lower_bound(room / FaceRooms::kPerPage * FaceRooms::kPerPage);
      ASSERT_EQ(opens_page, other == taken.end() || *other / FaceRooms::kPerPage != room / FaceRooms::kPerPage);
      ASSERT_TRUE(taken.insert(room).second) << "room " << room << ", step " << step;
      most = std::max(most, taken.size());
      ASSERT_LT(room, (most + FaceRooms::kPerPage - 1) / FaceRooms::kPerPage * FaceRooms::kPerPage) << "step " << step;
    } else {
      const auto left = std::next(taken.begin(), random.below(static_cast<std::uint32_t>(taken.size())));
      rooms.leave(*left);
      taken.erase(left);
    }
    if (!random.one_in(50)) continue;
    for (const std::uint32_t page : rooms.take_emptied_pages()) {
      const auto first = taken.lower_bound(page * FaceRooms::kPerPage);
      ASSERT_TRUE(first == taken.end() || *first >= (page + 1) * FaceRooms::kPerPage) << "page " << page;
    }
  }
  EXPECT_GT(most, 200U);
}

TEST(FaceRooms, TellEveryEmptiedPageOnceUntilItIsInUseAgain) {
  constexpr std::uint32_t kPages = 9;
  FaceRooms rooms;
  const auto fill = [&] {
    for (std::uint32_t i = 0; i < kPages * FaceRooms::kPerPage; ++i) (void)rooms.take();
  };
  fill();
  EXPECT_TRUE(rooms.take_emptied_pages().empty());
  for (std::uint32_t room = 0; room < kPages * FaceRooms::kPerPage; ++room) {
    if (room / FaceRooms::kPerPage != 4) rooms.leave(room);
  }
  std::vector<std::uint32_t> emptied = rooms.take_emptied_pages();
  std::sort(emptied.begin(), emptied.end());
  EXPECT_EQ(emptied, (std::vector<std::uint32_t>{0, 1, 2, 3, 5, 6, 7, 8}));
  EXPECT_TRUE(rooms.take_emptied_pages().empty());
  rooms.leave(rooms.take().room);
  EXPECT_EQ(rooms.take_emptied_pages().size(), 1U);
}

}  // namespace
}  // namespace fanstream
