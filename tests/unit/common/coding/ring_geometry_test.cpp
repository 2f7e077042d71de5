#include "common/coding/ring_geometry.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "tests/unit/common/coding/random_ring.h"

namespace fanstream {
namespace {

using testing::RandomRing;
using testing::SeededRandom;

TEST(RingGeometry, RanksOfAnArcAreAPermutationOfItsPlaces) {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const std::uint32_t size = 3 + random.below(28);
    const RandomRing ring(random, size, false, 1 + random.between(0, 5000));
    const RingGeometry geometry = ring.geometry(glm::vec3(1.0F, 1.0F, 3.5F));
    for (std::uint32_t length = 1; length < size; ++length) {
      std::vector<bool> used(size, false);
      for (std::uint32_t rank = 0; rank < size; ++rank) {
        const std::uint32_t first = geometry.first_of_rank(length, rank);
        ASSERT_LT(first, size);
        ASSERT_FALSE(used[first]) << "rank " << rank << ", length " << length;
        used[first] = true;
        ASSERT_EQ(geometry.rank_of_first(length, first), rank) << "length " << length;
      }
    }
  }
}

TEST(RingGeometry, DoesNotDependOnWhereTheStoredRingStarts) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const std::uint32_t size = 3 + random.below(12);
    RandomRing ring(random, size, random.one_in(2), 500);
    const RingGeometry expected = ring.geometry(glm::vec3(1.0F));
    for (std::uint32_t turn = 1; turn < size; ++turn) {
      std::rotate(ring.ring.begin(), ring.ring.begin() + 1, ring.ring.end());
      const RingGeometry turned = ring.geometry(glm::vec3(1.0F));
      ASSERT_EQ(turned.gap(), expected.gap());
      for (std::uint32_t i = 0; i < size; ++i) {
        ASSERT_EQ(turned.id(i), expected.id(i));
        ASSERT_EQ(to_vec3(turned.spoke(i)), to_vec3(expected.spoke(i)));
      }
      // To the last bit: the coder relies on it.
      ASSERT_EQ(to_vec3(turned.normal()), to_vec3(expected.normal()));
      ASSERT_EQ(turned.mean_length(), expected.mean_length());
      ASSERT_EQ(turned.bend(), expected.bend());
      for (std::uint32_t first = 0; first < size && !expected.is_open(); ++first) {
        ASSERT_EQ(turned.rank_of_first(2, first), expected.rank_of_first(2, first));
      }
    }
  }
}

TEST(RingGeometry, TheCanonicalRingStartsAtItsSmallestNumber) {
  SeededRandom random(3);
  for (int i = 0; i < 50; ++i) {
    const RandomRing ring(random, 7, i % 2 == 0, 90);
    const RingGeometry geometry = ring.geometry(glm::vec3(1.0F));
    for (std::uint32_t k = 1; k < geometry.size(); ++k) EXPECT_GT(geometry.id(k), geometry.id(0));
  }
}

TEST(RingGeometry, KnowsTheShapeOfASquare) {
  RingGeometry geometry;
  const std::vector<VertexId> ring{1, 2, 3, 4};
  const std::vector<GridPoint> places{{5, 5, 5}, {8, 5, 5}, {5, 8, 5}, {2, 5, 5}, {5, 2, 5}};
  geometry.assign(ring, 0, places, glm::vec3(1.0F));
  EXPECT_FALSE(geometry.is_open());
  EXPECT_EQ(geometry.gap(), 4U);
  EXPECT_EQ(to_vec3(geometry.normal()), glm::vec3(0, 0, 1));
  EXPECT_EQ(geometry.mean_length(), 3.0F);
  EXPECT_EQ(geometry.bend(), 0.0F);
}

TEST(RingGeometry, TheArcThatReachesFarthestRanksFirst) {
  RingGeometry geometry;
  const std::vector<VertexId> ring{1, 2, 3, 4};
  const std::vector<GridPoint> places{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-9, 0, 0}, {0, -1, 0}};
  geometry.assign(ring, 0, places, glm::vec3(1.0F));
  EXPECT_EQ(geometry.first_of_rank(2, 0), 1U);  // from 2 over 3 to 4
}

TEST(RingGeometry, ARingOnThePlaceOfItsRootIsSafe) {
  RingGeometry geometry;
  const std::vector<VertexId> ring{1, 2, 3};
  const std::vector<GridPoint> places(4, GridPoint(7, 7, 7));
  geometry.assign(ring, 0, places, glm::vec3(1.0F));
  EXPECT_EQ(to_vec3(geometry.normal()), glm::vec3(0, 0, 1));
  EXPECT_EQ(geometry.mean_length(), 0.0F);
  EXPECT_EQ(geometry.first_of_rank(1, 2), 2U);
}

}  // namespace
}  // namespace fanstream
