#include "client/collision/focus.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

TEST(Focus, MistakesAreRefused) {
  const auto sphere = [](double x, double radius) { return Focus{.sphere = FocusSphere{{x, 0, 0}, radius}}; };
  const auto facing = [](double x, double angle) { return Focus{.facing = FocusFacing{{x, 0, 0}, angle}}; };
  for (const Focus& bad : {sphere(0, -1), sphere(NAN, 1), sphere(0, INFINITY), sphere(1e80, 1), facing(0, 10),
                           facing(1, -1), facing(1, 181), facing(NAN, 10), facing(1, NAN)}) {
    const Result<void> checked = check_focus(bad);
    ASSERT_FALSE(checked);
    EXPECT_EQ(checked.error().kind, ErrorKind::usage);
  }
  EXPECT_TRUE(check_focus({}));
  EXPECT_TRUE(check_focus(sphere(3, 0)));
  EXPECT_TRUE(check_focus(facing(1e-50, 180)));
}

// What a box or a cone says holds for every triangle in it.
TEST(Focus, NoTriangleInFocusIsLeftOut) {
  testing::SeededRandom random(2);
  const auto point = [&] { return 2.0 * glm::dvec3(random.unit(), random.unit(), random.unit()) - 1.0; };
  int held = 0;
  for (int i = 0; i < 20000; ++i) {
    Focus focus;
    if (!random.one_in(3)) focus.sphere = FocusSphere{point(), random.unit()};
    if (!random.one_in(3)) focus.facing = FocusFacing{point(), 180.0 * random.unit()};
    const FocusTest test(focus);
    const std::array<glm::dvec3, 3> triangle{point(), point(), point()};
    if (!test.holds(triangle)) continue;
    ++held;
    Bounds box{triangle[0], triangle[0]};
    for (const glm::dvec3& p : triangle) box = {glm::min(box.low, p), glm::max(box.high, p)};
    EXPECT_TRUE(test.may_touch(box));
    const glm::dvec3 normal = glm::normalize(glm::cross(triangle[1] - triangle[0], triangle[2] - triangle[0]));
    EXPECT_TRUE(test.may_hold(code_cone(glm::vec3(normal), 0.999F)));
  }
  EXPECT_GT(held, 1000);
}

TEST(Focus, OfNothingHoldsNothing) {
  const FocusTest nothing{Focus{}};
  EXPECT_TRUE(nothing.is_empty());
  EXPECT_FALSE(nothing.holds({glm::dvec3(0), glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0)}));
}

TEST(Focus, DistanceIsToTheTriangleNotToItsCorners) {
  const std::array<glm::dvec3, 3> large{glm::dvec3(-10, -10, 0), glm::dvec3(10, -10, 0), glm::dvec3(0, 10, 0)};
  EXPECT_TRUE(FocusTest(Focus{.sphere = FocusSphere{{0, 0, 0.5}, 0.5}}).holds(large));
  EXPECT_FALSE(FocusTest(Focus{.sphere = FocusSphere{{0, 0, 0.5}, 0.49}}).holds(large));
}

}  // namespace
}  // namespace fanstream
