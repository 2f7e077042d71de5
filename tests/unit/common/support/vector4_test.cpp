#include "common/support/vector4.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::SeededRandom;

template <class Vector>
auto lanes(Vector v) {
  return std::array{v[0], v[1], v[2], v[3]};
}

Float4 random_lanes(SeededRandom& random) {
  const auto lane = [&] {
    return static_cast<float>(random.unit() - 0.5) * std::exp2(static_cast<float>(random.between(-8, 8)));
  };
  return Float4{lane(), lane(), lane(), lane()};
}

TEST(Vector4, WhetherALaneIsNegativeIsToldOfEach) {
  EXPECT_FALSE(any_negative(int4(0)));
  EXPECT_FALSE(any_negative(int4(std::numeric_limits<std::int32_t>::max())));
  EXPECT_TRUE(any_negative(int4(-1)));
  for (std::size_t lane = 0; lane < 4; ++lane) {
    Int4 v = int4(7);
    v[lane] = std::numeric_limits<std::int32_t>::min();
    EXPECT_TRUE(any_negative(v)) << lane;
  }
}

TEST(Vector4, IntegersPassThroughLanes) {
  EXPECT_EQ(lanes(int4(glm::ivec3(-3, 0, 1 << 30))), (std::array{-3, 0, 1 << 30, 0}));
  EXPECT_EQ(to_ivec3(Int4{5, -6, 7, 8}), glm::ivec3(5, -6, 7));
}

TEST(Vector4, LoadsAndStoresAnywhere) {
  for (std::size_t offset = 0; offset < 4; ++offset) {
    const auto numbers = std::make_unique<std::uint32_t[]>(offset + 4);  // exactly sized
    const auto copies = std::make_unique<std::uint32_t[]>(offset + 4);
    const auto reals = std::make_unique<float[]>(offset + 4);
    for (std::uint32_t i = 0; i < 4; ++i) {
      numbers[offset + i] = 0xFFFFFFF0U + i;
      reals[offset + i] = 0.5F + static_cast<float>(i);
    }
    store4(copies.get() + offset, load4(numbers.get() + offset));
    EXPECT_EQ(lanes(load4(copies.get() + offset)), (std::array{0xFFFFFFF0U, 0xFFFFFFF1U, 0xFFFFFFF2U, 0xFFFFFFF3U}));
    store4(reals.get() + offset, load4(reals.get() + offset) + float4(1.0F));
    EXPECT_EQ(lanes(load4(reals.get() + offset)), (std::array{1.5F, 2.5F, 3.5F, 4.5F}));
  }
}

TEST(Vector4, ConvertsFromAndToOtherVectors) {
  EXPECT_EQ(lanes(float4(glm::vec3(1, 2, 3))), (std::array{1.0F, 2.0F, 3.0F, 0.0F}));
  EXPECT_EQ(to_vec3(Float4{1, 2, 3, 4}), glm::vec3(1, 2, 3));
  EXPECT_EQ(lanes(to_float4(Int4{-1, 0, 1 << 24, -(1 << 30)})), (std::array{-1.0F, 0.0F, 16777216.0F, -1073741824.0F}));
}

TEST(Vector4, MasksChooseLaneByLane) {
  const Float4 a{1, 5, -0.0F, 7};
  const Float4 b{2, 5, 0.0F, -7};
  constexpr std::uint32_t kAll = ~0U;
  EXPECT_EQ(lanes(mask_of(a < b)), (std::array{kAll, 0U, 0U, 0U}));
  EXPECT_EQ(lanes(mask_of(a == b)), (std::array{0U, kAll, kAll, 0U}));
  EXPECT_EQ(lanes(chosen(mask_of(a < b), a, b)), (std::array{1.0F, 5.0F, 0.0F, -7.0F}));
  EXPECT_EQ(lanes(chosen(mask_of(a == b), uint4(1), kLaneNumbers)), (std::array{0U, 1U, 1U, 3U}));
  EXPECT_EQ(lanes(less(Uint4{0, 5, 6, 0x7FFFFFFFU}, uint4(6))), (std::array{kAll, kAll, 0U, 0U}));
}

TEST(Vector4, AnyBitsAreThoseOfAllLanes) {
  for (std::uint32_t bit = 0; bit < 32; ++bit) {
    for (std::size_t lane = 0; lane < 4; ++lane) {
      Uint4 v{};
      v[lane] = 1U << bit;
      ASSERT_EQ(any_bits(v), 1U << bit);
    }
  }
  EXPECT_EQ(any_bits(Uint4{1, 2, 4, 8}), 15U);
  EXPECT_EQ(any_bits(Uint4{}), 0U);
}

// Bit by bit, whatever is in the fourth lane: that is what the format is made of.
TEST(Vector4, DotAndCrossAreThoseOfPlainNumbers) {
  SeededRandom random(4);
  for (int i = 0; i < 1000; ++i) {
    const Float4 a = random_lanes(random);
    const Float4 b = random_lanes(random);
    const float dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    ASSERT_EQ(dot3(a, b), dot);
    const Float4 cross = rotate_axes(cross_rotated(a, b));
    ASSERT_EQ(to_vec3(cross),
              glm::vec3(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]));
    ASSERT_EQ(lanes(rotate_axes(a)), (std::array{a[1], a[2], a[0], a[3]}));
    const Float4 c = random_lanes(random);
    const Float4 d = random_lanes(random);
    const Float4 one = float4(1.0F);
    ASSERT_EQ(lanes(sums3(a, b, c, d)), (std::array{dot3(a, one), dot3(b, one), dot3(c, one), dot3(d, one)}));
  }
}

}  // namespace
}  // namespace fanstream
