#include "server/build/normal_cone.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <vector>

#include "tests/support/random_directions.h"

namespace fanstream {
namespace {

using testing::direction_on_rim;
using testing::random_direction;
using testing::SeededRandom;

TEST(ConeAround, HoldsEveryConeAndTouchesOne) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    std::vector<NormalCone> cones(1 + random.below(6));
    const glm::dvec3 about = random_direction(random);
    for (NormalCone& cone : cones) {
      cone.axis = glm::vec3(glm::normalize(about + 0.8 * random_direction(random)));
      cone.cosine = static_cast<float>(std::cos(random.unit()));
    }
    const std::optional<WideCone> all = cone_around(cones);
    ASSERT_TRUE(all);
    EXPECT_NEAR(glm::length(all->axis), 1.0, 1e-12);
    const double least = std::cos(std::min(all->half_angle, std::numbers::pi));
    double widest = 0.0;
    for (const NormalCone& cone : cones) {
      for (int i = 0; i < 50; ++i) {
        const glm::dvec3 rim = direction_on_rim(glm::dvec3(cone.axis), static_cast<double>(cone.cosine), random);
        EXPECT_GE(glm::dot(all->axis, rim), least - 1e-12);
      }
      const double along = glm::dot(all->axis, glm::normalize(glm::dvec3(cone.axis)));
      const double off = std::acos(std::clamp(along, -1.0, 1.0));
      widest = std::max(widest, off + std::acos(static_cast<double>(cone.cosine)));
    }
    EXPECT_LT(all->half_angle, widest + 1e-4);
  }
}

TEST(ConeAround, OfOneConeIsThatCone) {
  const NormalCone cone{{0.6F, 0.0F, 0.8F}, 0.5F};
  const std::optional<WideCone> all = cone_around({&cone, 1});
  ASSERT_TRUE(all);
  EXPECT_LT(glm::length(all->axis - glm::dvec3(0.6, 0.0, 0.8)), 1e-6);
  EXPECT_NEAR(all->half_angle, std::numbers::pi / 3.0, 1e-4);
}

TEST(ConeAround, WhereDirectionsAreUnknownOrCancelThereIsNone) {
  EXPECT_FALSE(cone_around({}));
  const NormalCone up{{0, 0, 1}, 0.9F};
  const std::vector<NormalCone> with_all{up, NormalCone{}};
  EXPECT_FALSE(cone_around(with_all));
  const std::vector<NormalCone> opposite{up, {{0, 0, -1}, 0.9F}};
  EXPECT_FALSE(cone_around(opposite));
}

}  // namespace
}  // namespace fanstream
