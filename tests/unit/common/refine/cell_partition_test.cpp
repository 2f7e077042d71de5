#include "common/refine/cell_partition.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <glm/common.hpp>
#include <numeric>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::SeededRandom;

std::vector<FanVertex> at(const std::vector<GridPoint>& points) {
  std::vector<FanVertex> vertices;
  for (const GridPoint& p : points) vertices.push_back({p, {}});
  return vertices;
}

std::vector<FanVertex> random_places(SeededRandom& random, std::size_t count, std::int32_t extent) {
  std::vector<GridPoint> places;
  for (std::size_t i = 0; i < count; ++i) {
    places.emplace_back(random.between(0, extent), random.between(0, extent), random.between(0, extent / 4));
  }
  return at(places);
}

// As the header says it, of vertices numbered in their order: sorted by place along the longest axis, then by number,
// and cut.
void cut_by_sorting(std::vector<VertexId> vertices, const std::vector<FanVertex>& places, const glm::vec3& unit,
                    std::uint32_t parts, std::vector<std::vector<VertexId>>& groups) {
  if (parts <= 1 || vertices.empty()) {
    std::sort(vertices.begin(), vertices.end());
    groups.push_back(vertices);
    for (std::uint32_t i = 1; i < parts; ++i) groups.emplace_back();
    return;
  }
  GridPoint low = places[vertices.front()].place;
  GridPoint high = low;
  for (const VertexId v : vertices) {
    low = glm::min(low, places[v].place);
    high = glm::max(high, places[v].place);
  }
  const glm::vec3 size = glm::vec3(high - low) * unit;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  std::sort(vertices.begin(), vertices.end(), [&](VertexId a, VertexId b) {
    return std::pair(places[a].place[axis], a) < std::pair(places[b].place[axis], b);
  });
  const auto middle = vertices.begin() + static_cast<std::ptrdiff_t>(vertices.size() * (parts / 2) / parts);
  cut_by_sorting({vertices.begin(), middle}, places, unit, parts / 2, groups);
  cut_by_sorting({middle, vertices.end()}, places, unit, parts - parts / 2, groups);
}

TEST(CellPartition, IsTheOneThatSortingGives) {
  for (std::uint64_t seed = 0; seed < 400; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    // From all at one place over many ties to none, or a step at one end.
    auto places = random_places(random, 1 + random.below(seed % 10 == 0 ? 5000 : 300), (1 << random.below(21)) - 1);
    if (random.one_in(4)) {
      for (FanVertex& v : places) v.place -= GridPoint(0, 100, 7);
      for (FanVertex& v : places) v.place = glm::max(v.place, GridPoint(0));
    }
    std::vector<VertexId> some;
    for (VertexId v = 0; v < places.size(); ++v) {
      if (seed % 2 == 0 || random.one_in(3)) some.push_back(v);
    }
    if (random.one_in(2)) random.shuffle(some);
    const glm::vec3 unit(1.0F, random.one_in(3) ? 5.0F : 1.0F, random.one_in(3) ? 4.0F : 1.0F);
    const std::uint32_t parts = 1 + random.below(40);
    std::vector<FanVertex> in_order;
    for (const VertexId v : some) in_order.push_back(places[v]);
    std::vector<VertexId> ranks(some.size());
    std::iota(ranks.begin(), ranks.end(), 0U);
    std::vector<std::vector<VertexId>> expected;
    cut_by_sorting(ranks, in_order, unit, parts, expected);
    for (auto& group : expected) {
      for (VertexId& v : group) v = some[v];
    }
    ASSERT_EQ(partition_vertices(some, places, unit, parts), expected);
  }
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

TEST(CellPartition, DependsOnTheOrderOfTheVerticesNotOnTheirNumbers) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const auto places = random_places(random, 300, 5);
    std::vector<VertexId> all(300);
    std::iota(all.begin(), all.end(), 0U);
    auto expected = partition_vertices(all, places, glm::vec3(1.0F), 7);
    std::vector<VertexId> renamed = all;
    random.shuffle(renamed);
    std::vector<FanVertex> moved(300);
    for (const VertexId v : all) moved[renamed[v]] = places[v];
    for (auto& group : expected) {
      for (VertexId& v : group) v = renamed[v];
    }
    EXPECT_EQ(partition_vertices(renamed, moved, glm::vec3(1.0F), 7), expected);
  }
}

TEST(CellPartition, CutsAcrossTheAxisThatIsLongestInSpace) {
  const auto places = at({{0, 0, 0}, {9, 0, 0}, {0, 5, 0}, {9, 5, 0}});
  using Groups = std::vector<std::vector<VertexId>>;
  EXPECT_EQ(partition_vertices(std::array<VertexId, 4>{0, 1, 2, 3}, places, glm::vec3(1.0F), 2),
            (Groups{{0, 2}, {1, 3}}));
  EXPECT_EQ(partition_vertices(std::array<VertexId, 4>{0, 1, 2, 3}, places, glm::vec3(1.0F, 4.0F, 1.0F), 2),
            (Groups{{0, 1}, {2, 3}}));
}

TEST(CellPartition, MorePartsThanVerticesLeaveGroupsEmpty) {
  const auto places = at({{0, 0, 0}, {9, 0, 0}});
  const auto groups = partition_vertices(std::array<VertexId, 2>{0, 1}, places, glm::vec3(1.0F), 5);
  ASSERT_EQ(groups.size(), 5U);
  std::size_t total = 0;
  for (const auto& group : groups) total += group.size();
  EXPECT_EQ(total, 2U);
  EXPECT_EQ(partition_vertices({}, places, glm::vec3(1.0F), 3).size(), 3U);
}

}  // namespace
}  // namespace fanstream
