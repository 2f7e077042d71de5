#include "common/grid/position_grid.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/exact_bytes.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::ExactBytes;
using testing::SeededRandom;

std::vector<glm::dvec3> random_points(SeededRandom& random, std::size_t count) {
  const double scale = std::exp(20.0 * (random.unit() - 0.5));
  const glm::dvec3 centre(1000.0 * random.unit(), -3.0, random.unit());
  std::vector<glm::dvec3> points;
  for (std::size_t i = 0; i < count; ++i) {
    points.push_back(scale * (centre + glm::dvec3(random.unit(), 0.3 * random.unit(), random.unit())));
  }
  return points;
}

std::vector<std::byte> written(const PositionGrid& grid) {
  ByteWriter out;
  grid.write(out);
  return out.take();
}

// A field of heights: x and y take few values, z takes many.
std::vector<glm::dvec3> height_field() { return testing::make_terrain(60, 50, 5).positions; }

TEST(PositionGrid, PointsOfTheGridComeBackExactly) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const int bits = random.between(kLeastPositionBits, kMostPositionBits);
    const auto points = random_points(random, 200);
    const PositionGrid grid = PositionGrid::fit(points, bits);
    for (const glm::dvec3& p : points) {
      const GridPoint code = grid.encode(p);
      ASSERT_TRUE(grid.contains(code));
      ASSERT_EQ(grid.encode(grid.decode(code)), code);
      for (int axis = 0; axis < 3; ++axis)
        ASSERT_LE(std::fabs(grid.decode(code)[axis] - p[axis]), 0.5001 * grid.step());
    }
  }
}

TEST(PositionGrid, TheLongestAxisUsesAllBits) {
  SeededRandom random(1);
  const PositionGrid grid = PositionGrid::fit(random_points(random, 5000), 10);
  EXPECT_EQ(std::max(grid.code_count(0), grid.code_count(2)), 1 << 10);
}

TEST(PositionGrid, ListsTheAxesOfAHeightField) {
  const auto points = height_field();
  const PositionGrid grid = PositionGrid::fit(points, 12);
  EXPECT_EQ(grid.code_count(0), 61);
  EXPECT_EQ(grid.code_count(1), 51);
  EXPECT_GT(grid.code_count(2), 100);
  EXPECT_NEAR(grid.unit().x, 4095.0 / 60.0, 1e-3);
  EXPECT_EQ(grid.unit().z, 1.0F);
  for (const glm::dvec3& p : points) {
    const GridPoint code = grid.encode(p);
    ASSERT_EQ(code.x, static_cast<std::int32_t>(p.x));
    ASSERT_EQ(code.y, static_cast<std::int32_t>(p.y));
    ASSERT_EQ(grid.encode(grid.decode(code)), code);
  }
}

TEST(PositionGrid, APlaceBetweenListedValuesGoesToTheNearest) {
  const PositionGrid grid = PositionGrid::fit(height_field(), 12);
  EXPECT_EQ(grid.encode({7.4, 7.6, 0.0}).x, 7);
  EXPECT_EQ(grid.encode({7.4, 7.6, 0.0}).y, 8);
  EXPECT_EQ(grid.encode({-99.0, 99.0, 0.0}).x, 0);
  EXPECT_EQ(grid.encode({-99.0, 99.0, 0.0}).y, 50);
}

TEST(PositionGrid, FlatAndSinglePointModelsHaveAGrid) {
  const PositionGrid flat = PositionGrid::fit(testing::make_grid(3, 3).positions, 10);
  EXPECT_EQ(flat.code_count(2), 1);
  EXPECT_EQ(flat.decode(flat.encode({3, 3, 0})), glm::dvec3(3, 3, 0));
  const PositionGrid point = PositionGrid::fit({{5, 6, 7}, {5, 6, 7}}, 10);
  EXPECT_EQ(point.encode({5, 6, 7}), GridPoint(0));
  EXPECT_EQ(point.decode(GridPoint(0)), glm::dvec3(5, 6, 7));
}

TEST(PositionGrid, CoordinatesAreThePlaceInSteps) {
  const auto points = height_field();
  const PositionGrid grid = PositionGrid::fit(points, 12);
  ASSERT_TRUE(grid.is_listed(0));
  for (const glm::dvec3& p : points) {
    const GridPoint code = grid.encode(p);
    const glm::dvec3 steps = (grid.decode(code) - grid.decode(GridPoint(0))) / grid.step();
    for (int axis = 0; axis < 3; ++axis) EXPECT_EQ(grid.coordinates(code)[axis], std::lround(steps[axis]));
  }
}

TEST(PositionGrid, ContainsExactlyItsCodes) {
  const PositionGrid grid = PositionGrid::fit(height_field(), 12);
  EXPECT_TRUE(grid.contains({60, 50, 0}));
  EXPECT_FALSE(grid.contains({61, 50, 0}));
  EXPECT_FALSE(grid.contains({0, -1, 0}));
}

TEST(PositionGrid, DefaultBitsFollowTheMeanEdge) {
  EXPECT_EQ(PositionGrid::default_bits(testing::make_grid(10, 10)), 10);
  EXPECT_EQ(PositionGrid::default_bits(testing::make_grid(500, 1)), 14);  // 24 * 500 needs 13.55 bits
  EXPECT_EQ(PositionGrid::default_bits({}), 10);
}

TEST(PositionGrid, BytesComeBack) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const auto points = seed % 2 == 0 ? height_field() : random_points(random, 300);
    const PositionGrid grid = PositionGrid::fit(points, random.between(kLeastPositionBits, kMostPositionBits));
    const ExactBytes bytes(written(grid));
    ByteReader in(bytes.view());
    const Result<PositionGrid> read = PositionGrid::read(in);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(in.remaining(), 0U);
    EXPECT_EQ(written(*read), written(grid));
    EXPECT_EQ(read->unit(), grid.unit());
    for (const glm::dvec3& p : points) {
      ASSERT_EQ(read->encode(p), grid.encode(p));
      ASSERT_EQ(read->decode(read->encode(p)), grid.decode(grid.encode(p)));
    }
  }
}

TEST(PositionGrid, EveryTruncationIsAnErrorThatNamesTheByte) {
  const auto bytes = written(PositionGrid::fit(height_field(), 12));
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const ExactBytes shorter{std::span(bytes).first(size)};
    ByteReader in(shorter.view());
    const Result<PositionGrid> read = PositionGrid::read(in);
    ASSERT_FALSE(read) << "cut to " << size;
    EXPECT_NE(read.error().message.find("byte"), std::string::npos) << read.error().message;
  }
}

TEST(PositionGrid, MutatedBytesAreAnErrorOrAUsableGrid) {
  const auto good = written(PositionGrid::fit(height_field(), 12));
  std::size_t errors = 0;
  for (std::uint64_t seed = 0; seed < 3000; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    ExactBytes bytes(good);
    for (std::uint32_t i = 0, n = 1 + random.below(4); i < n; ++i) {
      bytes.view()[random.below(good.size())] = static_cast<std::byte>(random.below(256));
    }
    ByteReader in(bytes.view());
    const Result<PositionGrid> read = PositionGrid::read(in);
    if (!read) {
      ++errors;
      continue;
    }
    const GridPoint most(read->code_count(0) - 1, read->code_count(1) - 1, read->code_count(2) - 1);
    ASSERT_TRUE(read->contains(GridPoint(0)));
    ASSERT_TRUE(read->contains(most));
    ASSERT_FALSE(std::isnan(read->decode(most).x));
    ASSERT_TRUE(read->contains(read->encode({1e300, -1e300, 0.0})));
  }
  EXPECT_GT(errors, 100U);
}

}  // namespace
}  // namespace fanstream
