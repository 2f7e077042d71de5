#include "common/refine/cell_partition.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::SeededRandom;

std::vector<GridPoint> random_places(SeededRandom& random, std::size_t count, std::int32_t extent) {
  std::vector<GridPoint> places;
  for (std::size_t i = 0; i < count; ++i) {
    places.emplace_back(random.between(0, extent), random.between(0, extent), random.between(0, extent / 4));
  }
  return places;
}

TEST(CellPartition, EveryVertexIsInOneGroupOfNearlyEqualSize) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const std::size_t count = 1 + random.below(500);
    const std::uint32_t parts = 1 + random.below(12);
    const auto places = random_places(random, count, seed % 3 == 0 ? 3 : 4000);  // many ties, or none
    std::vector<VertexId> all(count);
    for (VertexId v = 0; v < count; ++v) all[v] = v;
    const auto groups = partition_vertices(all, places, glm::vec3(1.0F), parts);
    ASSERT_EQ(groups.size(), parts);
    std::vector<bool> seen(count, false);
    for (const auto& group : groups) {
      EXPECT_LE(group.size(), count / parts + 4);
      EXPECT_GE(group.size() + 4, count / parts);
      for (std::size_t i = 0; i < group.size(); ++i) {
        ASSERT_FALSE(seen[group[i]]);
        seen[group[i]] = true;
        if (i > 0) {
          ASSERT_LT(group[i - 1], group[i]);
        }
      }
    }
    EXPECT_EQ(std::count(seen.begin(), seen.end(), true), static_cast<std::ptrdiff_t>(count));
  }
}

TEST(CellPartition, DoesNotDependOnTheOrderOfTheVertices) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const auto places = random_places(random, 300, 5);
    std::vector<VertexId> all(300);
    for (VertexId v = 0; v < 300; ++v) all[v] = v;
    const auto expected = partition_vertices(all, places, glm::vec3(1.0F), 7);
    random.shuffle(all);
    EXPECT_EQ(partition_vertices(all, places, glm::vec3(1.0F), 7), expected);
  }
}

TEST(CellPartition, CutsAcrossTheAxisThatIsLongestInSpace) {
  const std::vector<GridPoint> places{{0, 0, 0}, {9, 0, 0}, {0, 5, 0}, {9, 5, 0}};
  using Groups = std::vector<std::vector<VertexId>>;
  EXPECT_EQ(partition_vertices({0, 1, 2, 3}, places, glm::vec3(1.0F), 2), (Groups{{0, 2}, {1, 3}}));
  EXPECT_EQ(partition_vertices({0, 1, 2, 3}, places, glm::vec3(1.0F, 4.0F, 1.0F), 2), (Groups{{0, 1}, {2, 3}}));
}

TEST(CellPartition, MorePartsThanVerticesLeaveGroupsEmpty) {
  const std::vector<GridPoint> places{{0, 0, 0}, {9, 0, 0}};
  const auto groups = partition_vertices({0, 1}, places, glm::vec3(1.0F), 5);
  ASSERT_EQ(groups.size(), 5U);
  std::size_t total = 0;
  for (const auto& group : groups) total += group.size();
  EXPECT_EQ(total, 2U);
  EXPECT_EQ(partition_vertices({}, places, glm::vec3(1.0F), 3).size(), 3U);
}

}  // namespace
}  // namespace fanstream
