#include "client/session/damaged_segments.h"

#include <gtest/gtest.h>

namespace fanstream {
namespace {

MeshMove::Damage damage(std::uint32_t cell, std::uint32_t segment, const std::string& message) {
  return {cell, segment, {ErrorKind::bad_input, message}};
}

TEST(DamagedSegments, WhatIsReleasedIsNoLongerDamaged) {
  DamagedSegments damaged;
  EXPECT_TRUE(damaged.empty());
  EXPECT_EQ(damaged.reason(), "");
  damaged.add(damage(7, 2, "seven"));
  damaged.add(damage(3, 1, "three"));
  damaged.add(damage(9, 0, "nine"));
  EXPECT_EQ(damaged.reason(), "three");
  damaged.forget(std::vector<CellRun>{{0, 3, 0}, {4, 3, 0}, {3, 1, 2}, {7, 1, 3}, {8, 1, 0}, {10, 100, 0}});
  EXPECT_EQ(damaged.reason(), "three") << "other cells, and finer segments";
  damaged.forget(std::vector<CellRun>{{3, 5, 1}});
  EXPECT_EQ(damaged.reason(), "nine");
  damaged.forget(std::vector<CellRun>{{0, kMaxCells, 0}});
  EXPECT_TRUE(damaged.empty());
}

TEST(DamagedSegments, WhatComesDamagedAgainIsSaidAgain) {
  DamagedSegments damaged;
  damaged.add(damage(3, 1, "once"));
  damaged.add(damage(3, 1, "twice"));
  EXPECT_EQ(damaged.reason(), "twice");
  damaged.forget(std::vector<CellRun>{{3, 1, 0}});
  damaged.add(damage(3, 1, "again"));
  EXPECT_EQ(damaged.reason(), "again");
}

}  // namespace
}  // namespace fanstream
