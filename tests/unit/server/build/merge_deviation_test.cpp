#include "server/build/merge_deviation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "common/geometry/closest_point.h"
#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using Face = std::array<glm::dvec3, 3>;

double farthest_between(const std::vector<Face>& from, const std::vector<Face>& to) {
  double farthest = 0.0;
  constexpr int kSteps = 12;
  for (const Face& t : from) {
    for (int i = 0; i <= kSteps; ++i) {
      for (int j = 0; i + j <= kSteps; ++j) {
        const double u = static_cast<double>(i) / kSteps;
        const double v = static_cast<double>(j) / kSteps;
        const glm::dvec3 p = t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0]);
        double nearest = 1e300;
        for (const Face& face : to) {
          nearest = std::min(nearest, glm::distance(p, closest_point_on_triangle(p, face[0], face[1], face[2])));
        }
        farthest = std::max(farthest, nearest);
      }
    }
  }
  return farthest;
}

struct RandomPatch {
  std::vector<glm::dvec3> ring;
  std::size_t arc;
  glm::dvec3 first, second, merged;

  explicit RandomPatch(testing::SeededRandom& random) {
    const std::size_t size = 6 + random.below(5);
    const auto noise = [&](double scale) { return scale * (random.unit() - 0.5); };
    for (std::size_t i = 0; i < size; ++i) {
      const double angle = 2 * std::numbers::pi * (static_cast<double>(i) + noise(0.5)) / static_cast<double>(size);
      const double radius = 1.0 + noise(0.5);
      ring.push_back({radius * std::cos(angle), radius * std::sin(angle), noise(0.4)});
    }
    arc = 2 + random.below(static_cast<std::uint32_t>(size - 4));
    const glm::dvec3 across = ring[arc / 2];
    first = glm::dvec3{-0.2 * across.x, -0.2 * across.y, noise(0.3)};
    second = glm::dvec3{0.4 * across.x, 0.4 * across.y, noise(0.3)};
    const std::uint32_t where = random.below(3);
    merged = where == 0 ? first : where == 1 ? second : 0.5 * (first + second);
  }

  std::vector<Face> before() const {
    std::vector<Face> faces{{first, second, ring[arc]}, {second, first, ring[0]}};
    for (std::size_t i = 0; i < ring.size(); ++i) {
      faces.push_back({i < arc ? second : first, ring[i], ring[(i + 1) % ring.size()]});
    }
    return faces;
  }
  std::vector<Face> after() const {
    std::vector<Face> faces;
    for (std::size_t i = 0; i < ring.size(); ++i) faces.push_back({merged, ring[i], ring[(i + 1) % ring.size()]});
    return faces;
  }
  MergePatch patch() const { return {ring, ring.size(), arc, first, second, merged}; }
};

TEST(MergeDeviation, NoPointOfEitherSurfaceIsFartherFromTheOther) {
  MergeDeviation deviation;
  int tighter = 0;
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    testing::SeededRandom random(seed);
    const RandomPatch patch(random);
    const double bound = deviation.bound(patch.patch());
    const double measured =
        std::max(farthest_between(patch.before(), patch.after()), farthest_between(patch.after(), patch.before()));
    EXPECT_GE(bound, measured - 1e-9);
    const double moved = std::max(glm::distance(patch.first, patch.merged), glm::distance(patch.second, patch.merged));
    EXPECT_LE(bound, moved);
    tighter += bound < 0.9 * moved ? 1 : 0;
  }
  EXPECT_GT(tighter, 8);
}

TEST(MergeDeviation, AFlatPatchDoesNotMove) {
  MergeDeviation deviation;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    testing::SeededRandom random(seed);
    RandomPatch patch(random);
    for (glm::dvec3& p : patch.ring) p.z = 0.0;
    patch.first.z = patch.second.z = patch.merged.z = 0.0;
    EXPECT_LE(deviation.bound(patch.patch()), glm::distance(patch.first, patch.second));
    if (patch.merged == patch.first || patch.merged == patch.second) {
      const double bound = deviation.bound(patch.patch());
      EXPECT_TRUE(bound < 1e-12 || bound == glm::distance(patch.first, patch.second)) << "seed " << seed;
    }
  }
}

TEST(MergeDeviation, ABoundaryCountsHowFarItsCentresMove) {
  MergeDeviation deviation;
  const std::vector<glm::dvec3> ring{{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, 0, 0}};
  const MergePatch patch{ring, 3, 1, {-0.1, 0, 0}, {0.2, 0, 0}, {-0.1, 0, 0}};
  EXPECT_DOUBLE_EQ(deviation.bound(patch), 0.3);
}

}  // namespace
}  // namespace fanstream
