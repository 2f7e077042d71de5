#include "common/asset/coded_cone.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <set>
#include <tuple>

#include "tests/support/random_directions.h"

namespace fanstream {
namespace {

using testing::random_direction;
using testing::SeededRandom;

constexpr double kDegrees = 3.14159265358979323846 / 180.0;

double angle(const glm::dvec3& a, const glm::dvec3& b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

TEST(CodedCone, HasAnAxisOfLengthOneForAllPlacesAndEachOnce) {
  std::set<std::tuple<float, float, float>> axes;
  for (std::uint8_t u = 0; u < CodedCone::kPlaces; ++u) {
    for (std::uint8_t v = 0; v < CodedCone::kPlaces; ++v) {
      const glm::vec3 axis = CodedCone{1, u, v}.axis();
      EXPECT_NEAR(glm::length(glm::dvec3(axis)), 1.0, 1e-6);
      axes.emplace(axis.x, axis.y, axis.z);
      // A cone around the axis itself is coded by it.
      const CodedCone again = code_cone(axis, 1.0F);
      EXPECT_EQ(again, (CodedCone{1, u, v}));
    }
  }
  EXPECT_EQ(axes.size(), 256U);
}

TEST(CodedCone, CosinesAreThoseOfMultiplesOfTwelveDegrees) {
  EXPECT_EQ(CodedCone{}.cosine(), -1.0F);
  for (std::uint8_t width = 1; width <= CodedCone::kWidest; ++width) {
    EXPECT_NEAR((CodedCone{width, 0, 0}.cosine()), std::cos(12.0 * width * kDegrees), 1e-6);
  }
}

// Also where axes lie on the octahedron's edges and corners.
TEST(CodedCone, IsNeverNarrowerThanWhatItStandsFor) {
  SeededRandom random(1);
  double farthest_off = 0.0;
  for (int i = 0; i < 200'000; ++i) {
    glm::dvec3 exact = random_direction(random);
    if (random.one_in(4)) exact[random.below(3)] = 0.0;
    if (random.one_in(8)) exact[random.below(3)] = 0.0;
    if (glm::length(exact) < 0.1) continue;
    const glm::vec3 axis(glm::normalize(exact));
    const double half = random.one_in(5) ? 12.0 * kDegrees * random.below(8) : 1.6 * random.unit();
    const auto cosine = static_cast<float>(std::cos(half));
    const CodedCone coded = code_cone(axis, cosine);
    ASSERT_LE(coded.width, CodedCone::kWidest);
    ASSERT_LT(coded.u, CodedCone::kPlaces);
    ASSERT_LT(coded.v, CodedCone::kPlaces);
    const double off = angle(glm::dvec3(code_cone(axis, 1.0F).axis()), glm::dvec3(axis));
    farthest_off = std::max(farthest_off, off);
    if (coded.width == 0) {
      ASSERT_TRUE(coded == CodedCone{});
      ASSERT_EQ(coded.cosine(), -1.0F);
      ASSERT_GT(half + off + 1e-3, 84.0 * kDegrees) << "not given up without need";
      continue;
    }
    ASSERT_EQ(coded.axis(), code_cone(axis, 1.0F).axis());
    // In the precision in which it is used, too.
    ASSERT_LE(std::acos(std::min(1.0, static_cast<double>(cosine))) + off,
              std::acos(static_cast<double>(coded.cosine())));
    ASSERT_LE(12.0 * kDegrees * (coded.width - 1), half + off + 1e-3) << "no wider than it has to be";
  }
  EXPECT_LT(farthest_off, 15.0 * kDegrees);
}

TEST(CodedCone, HoldsTheDirectionsWithinItsHalfAngleWhateverTheirLength) {
  SeededRandom random(2);
  for (int i = 0; i < 20'000; ++i) {
    const auto place = [&] { return static_cast<std::uint8_t>(random.below(CodedCone::kPlaces)); };
    const CodedCone cone{static_cast<std::uint8_t>(1 + random.below(CodedCone::kWidest)), place(), place()};
    const glm::dvec3 direction = random_direction(random);
    const double off = angle(glm::dvec3(cone.axis()), direction) - 12.0 * kDegrees * cone.width;
    if (std::abs(off) < 1e-6) continue;
    EXPECT_EQ(cone.holds(std::pow(10.0, random.between(-20, 20)) * direction), off < 0.0);
  }
}

// Also exactly against the axis that its unused places would say.
TEST(CodedCone, OneWithoutWidthHoldsEveryDirection) {
  const glm::dvec3 against = -glm::dvec3(CodedCone{}.axis());
  SeededRandom random(3);
  for (int i = 0; i < 20'000; ++i) {
    const double length = std::pow(10.0, 20.0 * random.unit() - 10.0);
    ASSERT_TRUE(CodedCone{}.holds(length * against)) << length;
    ASSERT_TRUE(CodedCone{}.holds(length * random_direction(random)));
  }
}

TEST(CodedCone, WhatIsNoConeLooksAnywhere) {
  const glm::vec3 z(0.0F, 0.0F, 1.0F);
  const float nan = std::nanf("");
  EXPECT_EQ(code_cone(z, -1.0F), CodedCone{});
  EXPECT_EQ(code_cone(z, nan), CodedCone{});
  EXPECT_EQ(code_cone(glm::vec3(0.0F), 0.9F), CodedCone{});
  EXPECT_EQ(code_cone(glm::vec3(nan, 0.0F, 1.0F), 0.9F), CodedCone{});
  EXPECT_EQ(code_cone(z, static_cast<float>(std::cos(85.0 * kDegrees))), CodedCone{});
}

}  // namespace
}  // namespace fanstream
