#include "common/coding/place_precision.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/coding/rans.h"
#include "tests/support/exact_bytes.h"
#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::ExactBytes;
using testing::SeededRandom;

// 2^bits points along the longest axis, of which there is not a whole number of cells on the others.
PositionGrid cube(int bits) { return PositionGrid::fit({{0, 0, 0}, {0.77, 0.9, 1.0}}, bits); }

// Ten values on x, as a height field or CAD model has them.
PositionGrid listed() {
  std::vector<glm::dvec3> points;
  for (int i = 0; i < 400; ++i) points.emplace_back(0.1 * (i % 10), i / 400.0, std::fmod(i * 0.618, 1.0));
  return PositionGrid::fit(points, 12);
}

GridPoint any_code(const PositionGrid& grid, SeededRandom& random) {
  const auto any = [&](int axis) { return random.between(0, grid.code_count(axis) - 1); };
  return {any(0), any(1), any(2)};
}

TEST(PlacePrecision, AVertexIsKnownToItsLatticeUnlessItIsNeverSplit) {
  SeededRandom random(1);
  for (const int bits : {6, 10, 14, 20}) {
    const PositionGrid grid = cube(bits);
    const auto most = static_cast<std::uint8_t>(PlacePrecision::most_left_out(grid));
    const PlacePrecision precision(std::vector<std::uint8_t>{most, 3, 3, 1, 0}, grid);
    for (std::uint8_t touched = 0; touched <= 6; ++touched) {
      const PlaceLattice& lattice = precision.lattice(touched);
      const int half = (1 << precision.left_out(touched)) / 2;
      for (int i = 0; i < 500; ++i) {
        const GridPoint code = any_code(grid, random);
        const GridPoint shown = precision.shown(code, {touched, 7, 0});
        ASSERT_TRUE(grid.contains(shown)) << "at the upper edge too";
        ASSERT_TRUE(lattice.contains(lattice.point_of(code)));
        ASSERT_EQ(lattice.point_of(shown), lattice.point_of(code));
        for (int axis = 0; axis < 3; ++axis) ASSERT_LE(std::abs(shown[axis] - code[axis]), half);
        ASSERT_EQ(precision.shown(shown, {touched, 7, 0}), shown);
        ASSERT_EQ(precision.shown(code, {touched, kNeverSplit, 0}), code);
      }
    }
  }
}

TEST(PlacePrecision, AVertexThatRestsForLongIsKnownBetterThanWhenItWasTouched) {
  constexpr std::uint32_t kRest = PlacePrecision::kLongestRest;
  for (std::uint32_t touched = 1; touched < 20; ++touched) {
    for (std::uint32_t next = touched + 1; next <= kMostGenerations; ++next) {
      const std::uint32_t known = PlacePrecision::known_in(touched, next);
      EXPECT_EQ(known, next - touched > kRest ? next - kRest : touched) << touched << " to " << next;
      EXPECT_LT(known, next);
    }
    EXPECT_EQ(PlacePrecision::known_in(touched, kNeverSplit), kMostGenerations);
  }
  EXPECT_EQ(PlacePrecision::known_in(0, 30), 0U) << "FM0 is told before it is known when its vertices are split";
  const PositionGrid grid = cube(14);
  const PlacePrecision precision(std::vector<std::uint8_t>{6, 6, 5, 4, 2, 0}, grid);
  SeededRandom random(3);
  for (int i = 0; i < 500; ++i) {
    const GridPoint code = any_code(grid, random);
    const PlaceLattice& lattice = precision.lattice(3);
    EXPECT_EQ(precision.shown(code, {1, static_cast<std::uint8_t>(3 + kRest), 0}),
              lattice.code_of(lattice.point_of(code)));
    EXPECT_EQ(precision.shown(code, {1, static_cast<std::uint8_t>(5 + kRest), 0}), code);
  }
}

TEST(PlacePrecision, WhatGenerationsLeaveOutComesBackByLowBits) {
  SeededRandom random(2);
  const PositionGrid grid = cube(16);
  const PlacePrecision precision(std::vector<std::uint8_t>{12, 9, 7, 4, 4, 1, 0}, grid);
  std::vector<std::pair<LatticeStep, LowBits>> steps;
  RansEncoder encoder;
  for (int i = 0; i < 400; ++i) {
    const GridPoint code = any_code(grid, random);
    const std::uint32_t from = random.below(7);
    const std::uint32_t to = from + random.below(7 - from);
    const LatticeStep step(precision.lattice(from), precision.lattice(to));
    const GridPoint fine = precision.lattice(to).point_of(code);
    const LowBits low = step.low_bits_of(fine);
    ASSERT_LT(low, LowBits{1} << step.bit_count);
    ASSERT_EQ(step.coarse(fine), precision.lattice(from).point_of(code));
    ASSERT_EQ(step.fine(step.coarse(fine), low), fine);
    const LatticeStep rest(precision.lattice(to));
    ASSERT_EQ(rest.fine(fine, rest.low_bits_of(code)), code);
    ASSERT_EQ(step.code(encoder, low), low);
    steps.emplace_back(step, low);
  }
  const ExactBytes bytes(encoder.finish());
  RansDecoder decoder(bytes.view());
  for (const auto& [step, low] : steps) ASSERT_EQ(step.code(decoder, 0), low);
  EXPECT_TRUE(decoder.finished_cleanly());
}

TEST(PlacePrecision, AxesWithListedValuesStayExact) {
  const PositionGrid grid = listed();
  ASSERT_TRUE(grid.is_listed(0));
  ASSERT_FALSE(grid.is_listed(2));
  const PlacePrecision precision(std::vector<std::uint8_t>{4, 2, 0}, grid);
  EXPECT_EQ(precision.lattice(0).shift, GridPoint(0, 4, 4));
  EXPECT_EQ(precision.lattice(0).left_out, 8U);
  EXPECT_EQ(precision.left_out(0), 4U);
  EXPECT_EQ(precision.shown({7, 33, 33}, {0, 1, 0}), GridPoint(7, 40, 40));
}

TEST(PlacePrecision, ShortAxesKeepTheirHighestBit) {
  const PositionGrid grid = PositionGrid::fit({{0, 0, 0}, {1, 6.2 / 1023, 0}}, 10);
  ASSERT_EQ(grid.code_count(1), 7);
  ASSERT_EQ(grid.code_count(2), 1);
  const PlacePrecision precision(std::vector<std::uint8_t>{5, 1, 0}, grid);
  EXPECT_EQ(precision.lattice(0).shift, GridPoint(5, 2, 0));
  EXPECT_EQ(precision.lattice(0).left_out, 7U);
  EXPECT_EQ(precision.lattice(1).shift, GridPoint(1, 1, 0));
  EXPECT_EQ(precision.shown({1023, 6, 0}, {0, 1, 0}), GridPoint(1008, 6, 0));
}

TEST(PlacePrecision, ComesBackFromItsBits) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const PositionGrid grid = random.one_in(3) ? listed() : cube(static_cast<int>(6 + random.below(15)));
    const std::uint32_t generations = 1 + random.below(kMostGenerations);
    std::vector<std::uint8_t> left_out;
    std::uint32_t left = random.below(PlacePrecision::most_left_out(grid) + 1);
    for (std::uint32_t g = 0; g < generations; ++g) {
      left_out.push_back(static_cast<std::uint8_t>(left));
      if (random.one_in(3)) left = random.below(left + 1);
    }
    const PlacePrecision precision(left_out, grid);
    ByteWriter out;
    BitWriter bits(out);
    precision.write(bits);
    bits.finish();
    EXPECT_LE(out.size(), (4U + generations + 12U + 7U) / 8U);
    const ExactBytes bytes(out.view());
    ByteReader in(bytes.view());
    BitReader read_bits(in);
    const auto read = PlacePrecision::read(read_bits, grid, generations);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_TRUE(*read == precision);
    EXPECT_EQ(in.remaining(), 0U);
  }
}

TEST(PlacePrecision, AnyBytesAreAnErrorOrATableThatFallsToNothing) {
  std::size_t refused = 0;
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const PositionGrid grid = cube(static_cast<int>(6 + random.below(10)));
    std::vector<std::byte> noise(random.below(12));
    for (std::byte& b : noise) b = static_cast<std::byte>(random.below(256));
    const ExactBytes bytes(noise);
    ByteReader in(bytes.view());
    BitReader bits(in);
    const std::uint32_t generations = 1 + random.below(20);
    const auto read = PlacePrecision::read(bits, grid, generations);
    if (!read) {
      ++refused;
      EXPECT_NE(read.error().message.find("precision of places"), std::string::npos);
      continue;
    }
    EXPECT_LE(read->left_out(0), PlacePrecision::most_left_out(grid));
    for (std::uint32_t g = 1; g <= kMostGenerations; ++g) ASSERT_LE(read->left_out(g), read->left_out(g - 1));
    EXPECT_EQ(read->left_out(generations), 0U);
  }
  EXPECT_GT(refused, 200U);
  EXPECT_LT(refused, 1900U);
}

}  // namespace
}  // namespace fanstream
