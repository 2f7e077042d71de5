#include "common/coding/ring_geometry.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>

#include "tests/unit/common/coding/random_ring.h"

namespace fanstream {
namespace {

using testing::RandomRing;
using testing::SeededRandom;

constexpr Float4 kSteps = {1.0F, 1.0F, 1.0F, 0.0F};

// A closed fan around vertex 0 of the others in order, starting at 1.
LinkedFans fan_of(VertexId count) {
  std::vector<Triangle> faces;
  for (VertexId v = 2; v < count; ++v) faces.push_back({0, v, v + 1 < count ? v + 1 : 1});
  faces.push_back({0, 1, 2});
  return {count, faces};
}

std::vector<FanVertex> at(const std::vector<GridPoint>& places) {
  std::vector<FanVertex> vertices;
  for (const GridPoint& place : places) vertices.push_back({place, {}});
  return vertices;
}

std::uint32_t random_size(SeededRandom& random) {
  return random.one_in(10) ? 17 + random.below(200) : 3 + random.below(15);
}

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

TEST(RingGeometry, TheRingStartsWhereTheFanDoes) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const std::uint32_t size = random_size(random);
    const bool open = random.one_in(2);
    const RandomRing ring(random, size, open, 90);
    const RingGeometry geometry = ring.geometry(glm::vec3(1.0F));
    ASSERT_EQ(geometry.size(), size);
    ASSERT_EQ(geometry.is_open(), open);
    ASSERT_EQ(geometry.corner(0), ring.fans.corner(0));
    const LinkedFans::Corner* corners = ring.fans.corners();
    for (std::uint32_t i = 0; i < size; ++i) {
      ASSERT_EQ(geometry.id(i), ring.ring[i]);
      ASSERT_EQ(geometry.id(i) == kOutside, i == geometry.gap());
      ASSERT_EQ(corners[geometry.corner(i)].neighbour, geometry.id(i));
      ASSERT_EQ(corners[geometry.corner(i)].next, geometry.corner((i + 1) % size));
      ASSERT_EQ(corners[geometry.corner((i + geometry.size() - 1) % geometry.size())].next, geometry.corner(i));
      ASSERT_EQ(geometry.wrap(i + size), i);
      for (std::uint32_t k = 0; k < size; ++k) ASSERT_EQ(geometry.steps(i, k), (k + size - i) % size);
    }
  }
}

TEST(RingGeometry, AnArcNamesTheCornersFromItsFirstWingOnceAround) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const std::uint32_t size = random_size(random);
    const RandomRing ring(random, size, random.one_in(2), 90);
    RingGeometry geometry;
    geometry.load(ring.fans, 0);
    const LinkedFans::Corner* corners = ring.fans.corners();
    for (std::uint32_t first = 0; first < size; ++first) {
      const std::uint32_t last = (first + 1 + random.below(size - 1)) % size;
      const LinkedFans::Arc arc = geometry.arc(first, last);
      ASSERT_EQ(arc.size, size);
      ASSERT_EQ((first + arc.length) % size, last);
      for (std::uint32_t i = 0; i < size; ++i) {
        ASSERT_EQ(arc.corners[i], geometry.corner((first + i) % size));
        ASSERT_EQ(arc.backs[i] / 4, arc.corners[i] / 4);  // of one face
        ASSERT_EQ(corners[arc.backs[i]].neighbour, 0U);
      }
    }
  }
}

// All that a coder sees of a ring, bit by bit.
std::vector<float> image(const RingGeometry& ring) {
  std::vector<float> all{ring.mean_square(), ring.bend_square(), static_cast<float>(ring.gap())};
  const auto add = [&](Float4 v) { all.insert(all.end(), {v[0], v[1], v[2], v[3]}); };
  add(ring.normal());
  for (std::uint32_t i = 0; i < ring.size(); ++i) add(ring.spoke(i));
  for (std::uint32_t i = 0; i <= 2 * ring.size(); ++i) all.push_back(ring.square_sums()[i]);
  for (std::uint32_t i = 0; i < ring.size() && !ring.is_open(); ++i) {
    all.push_back(static_cast<float>(ring.rank_of_first(1, i)));
    all.push_back(static_cast<float>(ring.rank_of_first(2, i)));
    all.push_back(static_cast<float>(ring.first_of_rank(2, i)));
  }
  return all;
}

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

// To the last bit: the coder relies on it.
TEST(RingGeometry, WhatARingWasUsedForBeforeDoesNotMatter) {
  SeededRandom random(21);
  RingGeometry used;
  for (int i = 0; i < 1000; ++i) {
    SCOPED_TRACE("ring " + std::to_string(i));
    const RandomRing ring(random, random_size(random), random.one_in(3), 1 << random.below(15));
    const std::vector<float> expected = image(ring.geometry(glm::vec3(1.0F)));
    used.assign(ring.fans, 0, ring.vertices, kSteps);
    ASSERT_TRUE(same_bits(image(used), expected));
    FanWalk walk;  // entries beyond those that are filled hold anything
    walk.ids.fill(0xDEADBEEFU);
    walk.corners.fill(0xDEADBEEFU);
    walk.go_around(ring.fans, 0);
    used.load(ring.fans, 0, walk);
    used.measure(ring.vertices, kSteps);
    ASSERT_TRUE(same_bits(image(used), expected));
  }
}

TEST(RingGeometry, AWalkGoesAroundAgain) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const std::uint32_t size = random_size(random);
    const RandomRing ring(random, size, random.one_in(2), 90);
    FanWalk walk;
    walk.go_around(ring.fans, 0);
    ASSERT_EQ(walk.size, size);
    ASSERT_GE((walk.size <= 8 ? 8U : FanWalk::kEntries), std::min(size, FanWalk::kEntries));
    for (std::uint32_t i = 0; i < (walk.size <= 8 ? 8U : FanWalk::kEntries); ++i) {
      ASSERT_EQ(walk.ids[i], ring.ring[i % size]);
      ASSERT_EQ(ring.fans.corners()[walk.corners[i]].neighbour, walk.ids[i]);
    }
  }
}

// The same in double precision, straight from the definitions.
TEST(RingGeometry, MeasuresWhatItSays) {
  const glm::dvec3 unit(1.0, 2.5, 1.0);
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const std::uint32_t size = random_size(random);
    const RandomRing ring(random, size, random.one_in(2), 1000);
    const RingGeometry geometry = ring.geometry(glm::vec3(unit));
    std::vector<glm::dvec3> spokes;
    for (const VertexId v : ring.ring) {
      spokes.push_back(v == kOutside ? glm::dvec3(0.0)
                                     : glm::dvec3(ring.vertices[v].place - ring.vertices[0].place) * unit);
    }
    glm::dvec3 normal(0.0);
    double squares = 0.0;
    double twice = 0.0;
    for (std::uint32_t i = 0; i < 2 * size; ++i) {
      ASSERT_NEAR(static_cast<double>(geometry.square_sums()[i]), twice, 1e-5 * twice);
      twice += glm::dot(spokes[i % size], spokes[i % size]);
    }
    for (std::uint32_t i = 0; i < size; ++i) {
      ASSERT_NEAR(glm::distance(glm::dvec3(to_vec3(geometry.spoke(i))), spokes[i]), 0.0, 1e-3);
      ASSERT_EQ(geometry.spoke(i)[3], 0.0F);
      normal += glm::cross(spokes[i], spokes[(i + 1) % size]);
      squares += glm::dot(spokes[i], spokes[i]);
    }
    const double count = geometry.is_open() ? size - 1 : size;
    ASSERT_NEAR(static_cast<double>(geometry.mean_square()), squares / count, 1e-5 * squares / count + 1e-9);
    if (glm::length(normal) < 1e-3 * squares) continue;  // of no direction to speak of
    normal = glm::normalize(normal);
    ASSERT_NEAR(glm::distance(glm::dvec3(to_vec3(geometry.normal())), normal), 0.0, 1e-2);
    double bend = 0.0;
    const glm::dvec3 used(to_vec3(geometry.normal()));
    for (const glm::dvec3& s : spokes) bend += glm::dot(s, used) * glm::dot(s, used) / count;
    ASSERT_NEAR(static_cast<double>(geometry.bend_square()), bend, 1e-4 * squares / count + 1e-6);
  }
}

TEST(RingGeometry, KnowsTheShapeOfASquare) {
  RingGeometry geometry;
  const auto vertices = at({{5, 5, 5}, {8, 5, 5}, {5, 8, 5}, {2, 5, 5}, {5, 2, 5}});
  geometry.assign(fan_of(5), 0, vertices, kSteps);
  EXPECT_FALSE(geometry.is_open());
  EXPECT_EQ(geometry.gap(), 4U);
  EXPECT_EQ(to_vec3(geometry.normal()), glm::vec3(0, 0, 1));
  EXPECT_EQ(geometry.mean_square(), 9.0F);
  EXPECT_EQ(geometry.bend_square(), 0.0F);
}

TEST(RingGeometry, TheArcThatReachesFarthestRanksFirst) {
  RingGeometry geometry;
  const auto vertices = at({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-9, 0, 0}, {0, -1, 0}});
  geometry.assign(fan_of(5), 0, vertices, kSteps);
  ASSERT_EQ(geometry.id(0), 1U);
  EXPECT_EQ(geometry.first_of_rank(2, 0), 1U);  // from 2 over 3 to 4
}

TEST(RingGeometry, ARingOnThePlaceOfItsRootIsSafe) {
  RingGeometry geometry;
  const auto vertices = at(std::vector<GridPoint>(4, GridPoint(7, 7, 7)));
  geometry.assign(fan_of(4), 0, vertices, kSteps);
  EXPECT_EQ(to_vec3(geometry.normal()), glm::vec3(0, 0, 1));
  EXPECT_EQ(geometry.mean_square(), 0.0F);
  EXPECT_EQ(geometry.first_of_rank(1, 2), 2U);
}

}  // namespace
}  // namespace fanstream
