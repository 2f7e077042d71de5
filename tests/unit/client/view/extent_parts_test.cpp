#include "client/view/extent_parts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "tests/support/random_directions.h"

namespace fanstream {
namespace {

using testing::random_direction;
using testing::SeededRandom;

// On a bent sheet, as a cell's corners are.
std::vector<glm::dvec3> random_sheet(SeededRandom& random, std::size_t count) {
  std::vector<glm::dvec3> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = random.unit();
    const double y = 3.0 * random.unit();
    points.emplace_back(100.0 + x, y, 0.3 * std::sin(2.0 * y) * x);
  }
  return points;
}

bool holds(const ExtentPart& part, const glm::dvec3& point, double margin) {
  return glm::distance(part.center, point) + margin <= part.radius * (1.0 + 1e-9);
}

bool hold(const std::vector<ExtentPart>& parts, const std::vector<glm::dvec3>& points, double margin) {
  return std::all_of(points.begin(), points.end(), [&](const glm::dvec3& p) {
    return std::any_of(parts.begin(), parts.end(), [&](const ExtentPart& part) { return holds(part, p, margin); });
  });
}

TEST(ExtentParts, HoldAllPointsAndAreSmall) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const std::size_t count = 12 + random.below(500);
    const double margin = random.one_in(2) ? 0.0 : 0.1 * random.unit();
    std::vector<glm::dvec3> points = random_sheet(random, count);
    const std::vector<glm::dvec3> before = points;
    const std::vector<ExtentPart> parts = parts_around(points, margin);
    ASSERT_GE(parts.size(), 4U);
    EXPECT_LE(parts.size(), kMostParts);
    EXPECT_GE(count, parts.size() * kPointsOfPart);
    EXPECT_TRUE(hold(parts, before, margin));
    for (const ExtentPart& part : parts) EXPECT_LT(part.radius, 1.0 + margin);  // the whole has 1.6
  }
}

TEST(ExtentParts, OfFewPointsThereAreNone) {
  SeededRandom random(1);
  std::vector<glm::dvec3> points = random_sheet(random, 4 * kPointsOfPart - 1);
  EXPECT_TRUE(parts_around(points, 0.0).empty());
  EXPECT_TRUE(parts_around({}, 0.0).empty());
  std::vector<ExtentPart> none;
  EXPECT_FALSE(widen(none, points, 0.0));
}

TEST(ExtentParts, WidenToHoldMoreAndNeverLess) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    std::vector<glm::dvec3> points = random_sheet(random, 100);
    const std::vector<glm::dvec3> first = points;
    std::vector<ExtentPart> parts = parts_around(points, 0.01);
    EXPECT_FALSE(widen(parts, first, 0.01)) << "they lie within";
    EXPECT_FALSE(widen(parts, first, 0.005));
    std::vector<glm::dvec3> more = random_sheet(random, 30);
    for (glm::dvec3& p : more) p += 0.5 * random_direction(random);
    const std::vector<ExtentPart> before = parts;
    EXPECT_TRUE(widen(parts, more, 0.02));
    EXPECT_TRUE(hold(parts, first, 0.01));
    EXPECT_TRUE(hold(parts, more, 0.02));
    for (std::size_t i = 0; i < parts.size(); ++i) {
      EXPECT_GE(parts[i].radius * (1.0 + 1e-9), glm::distance(parts[i].center, before[i].center) + before[i].radius);
    }
    EXPECT_FALSE(widen(parts, more, 0.02)) << "once is enough";
  }
}

TEST(Enclose, MakesTheSmallestSphereAroundTwo) {
  glm::dvec3 center(0.0);
  double radius = 1.0;
  EXPECT_FALSE(enclose(center, radius, {0.5, 0, 0}, 0.5));
  EXPECT_EQ(radius, 1.0);
  EXPECT_TRUE(enclose(center, radius, {4, 0, 0}, 1.0));
  EXPECT_NEAR(center.x, 2.0, 1e-9);
  EXPECT_NEAR(radius, 3.0, 1e-9);
  EXPECT_TRUE(enclose(center, radius, {0, 0, 0}, 10.0)) << "the other one holds it";
  EXPECT_EQ(center, glm::dvec3(0.0));
  EXPECT_EQ(radius, 10.0);
}

}  // namespace
}  // namespace fanstream
