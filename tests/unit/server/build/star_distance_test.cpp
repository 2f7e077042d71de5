#include "server/build/star_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/geometry/closest_point.h"
#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::SeededRandom;

// On the grid, among them needles, faces without area and corners at the centre.
glm::vec3 random_place(SeededRandom& random) {
  const int size = random.one_in(3) ? 3 : 3000;
  return {random.between(-size, size), random.between(-size, size), random.one_in(4) ? 0 : random.between(-size, size)};
}

double exact(const glm::vec3& p, const glm::vec3& b, const glm::vec3& c) {
  const glm::dvec3 q(p);
  return glm::distance(q, closest_point_on_triangle(q, glm::dvec3(0.0), glm::dvec3(b), glm::dvec3(c)));
}

TEST(StarDistance, IsThatOfThePointsAndFacesWithinItsMargin) {
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    StarDistance star;
    std::vector<std::pair<glm::vec3, glm::vec3>> faces(1 + random.below(11));
    for (auto& [b, c] : faces) {
      b = random_place(random);
      c = random.one_in(8) ? b : random_place(random);
      star.add(b, c);
    }
    star.finish(false);
    std::vector<float> all(star.stored());
    const glm::vec3 p = random_place(random);
    const StarDistance::Nearest nearest = star.nearest(p, all.data());
    const double margin = StarDistance::kMargin * 3000.0;
    double least = std::numeric_limits<double>::infinity();
    for (std::uint32_t f = 0; f < faces.size(); ++f) {
      const double expected = exact(p, faces[f].first, faces[f].second);
      least = std::min(least, expected);
      EXPECT_NEAR(std::sqrt(all[f]), expected, margin + 1e-4 * expected) << "face " << f;
      EXPECT_GE(std::sqrt(all[f]) + margin, expected) << "face " << f;
      const std::uint32_t other = random.below(faces.size());
      const Float4 two = star.squared(FourPoints{float4(p.x), float4(p.y), float4(p.z)}, f, other);
      EXPECT_EQ(two[0], all[f]);
      EXPECT_EQ(two[3], all[other]);
    }
    EXPECT_EQ(nearest.squared, all[nearest.face]);
    EXPECT_NEAR(std::sqrt(nearest.squared), least, margin + 1e-4 * least);
  }
}

TEST(StarDistance, ThePlaneBetweenTwoFacesHasThemOnItsTwoSides) {
  StarDistance star;
  const glm::vec3 around[] = {{5, 0, 1}, {0, 5, 0}, {-5, 0, 2}, {0, -5, 1}};
  for (int i = 0; i < 4; ++i) star.add(around[i], around[(i + 1) % 4]);
  star.finish(true);
  for (std::uint32_t f = 0; f < 4; ++f) {
    EXPECT_EQ(star.after(f), (f + 1) % 4);
    EXPECT_EQ(star.before(f), (f + 3) % 4);
    EXPECT_LT(star.side(around[f], f), 0.0F);
    EXPECT_NEAR(star.side(around[(f + 1) % 4], f), 0.0F, 1e-5F);
    EXPECT_GT(star.side(around[(f + 2) % 4], f), 0.0F);
  }
}

}  // namespace
}  // namespace fanstream
