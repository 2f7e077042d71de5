#include "common/geometry/quadric.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::SeededRandom;

glm::dvec3 random_vector(SeededRandom& random) {
  const auto one = [&] { return random.between(-1000, 1000) / 1000.0; };
  return {one(), one(), one()};
}

struct Plane {
  glm::dvec3 n;
  double offset, weight;
};

std::vector<Plane> random_planes(SeededRandom& random, int count) {
  std::vector<Plane> planes;
  while (static_cast<int>(planes.size()) < count) {
    const glm::dvec3 n = random_vector(random);
    if (glm::length(n) > 0.1)
      planes.push_back({glm::normalize(n), random.between(-50, 50) / 50.0, 0.1 + random.below(9)});
  }
  return planes;
}

Quadric quadric_of(const std::vector<Plane>& planes) {
  Quadric q;
  for (const Plane& p : planes) q.add_plane(p.n, p.offset, p.weight);
  return q;
}

TEST(Quadric, IsTheWeightedSumOfSquaredDistancesFromThePlanes) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    SeededRandom random(seed);
    const std::vector<Plane> planes = random_planes(random, 6);
    const glm::dvec3 p = random_vector(random);
    double sum = 0.0;
    for (const Plane& plane : planes) sum += plane.weight * std::pow(glm::dot(plane.n, p) + plane.offset, 2.0);
    EXPECT_NEAR(quadric_of(planes).at(p), sum, 1e-12 * (1.0 + sum)) << "seed " << seed;
  }
}

// k = -(u A P0^T + P0 A u^T) / (2 u A u^T), A = sum n^T n in homogeneous coordinates: the closed form of the source.
TEST(Quadric, TheLeastOnALineIsTheClosedFormInHomogeneousCoordinates) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    SeededRandom random(seed);
    const std::vector<Plane> planes = random_planes(random, 5);
    const glm::dvec3 a = random_vector(random);
    const glm::dvec3 u = random_vector(random) + glm::dvec3(0.0, 0.0, 2.0);
    double matrix[4][4] = {};
    for (const Plane& p : planes) {
      const double n[4] = {p.n.x, p.n.y, p.n.z, p.offset};
      for (int i = 0; i < 4; ++i) {
        for (int j = 0; j < 4; ++j) matrix[i][j] += p.weight * n[i] * n[j];
      }
    }
    const auto form = [&](const double(&x)[4], const double(&y)[4]) {
      double sum = 0.0;
      for (int i = 0; i < 4; ++i) {
        for (int j = 0; j < 4; ++j) sum += x[i] * matrix[i][j] * y[j];
      }
      return sum;
    };
    const double p0[4] = {a.x, a.y, a.z, 1.0};
    const double along[4] = {u.x, u.y, u.z, 0.0};
    const double expected = -(form(along, p0) + form(p0, along)) / (2.0 * form(along, along));
    const std::optional<double> k = least_on_line(quadric_of(planes), a, u);
    ASSERT_TRUE(k) << "seed " << seed;
    EXPECT_NEAR(*k, expected, 1e-9 * (1.0 + std::fabs(expected))) << "seed " << seed;
  }
}

TEST(Quadric, OnALineInAllPlanesNothingIsLeast) {
  Quadric flat;
  flat.add_plane({0.0, 0.0, 1.0}, 0.5, 3.0);
  EXPECT_FALSE(least_on_line(flat, {1.0, 2.0, 3.0}, {1.0, -4.0, 0.0}));
  EXPECT_FALSE(least_on_line(flat, {1.0, 2.0, 3.0}, {0.0, 0.0, 0.0}));
  EXPECT_FALSE(least_on_line(Quadric{}, {1.0, 2.0, 3.0}, {0.0, 0.0, 1.0}));
  EXPECT_TRUE(least_on_line(flat, {1.0, 2.0, 3.0}, {0.0, 0.1, 0.01}));
}

TEST(Quadric, NowhereElseIsItLess) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    SeededRandom random(seed);
    const Quadric q = quadric_of(random_planes(random, 8));
    const glm::dvec3 near = random_vector(random);
    const std::optional<glm::dvec3> least = least_anywhere(q, near);
    ASSERT_TRUE(least) << "seed " << seed;
    // The pull towards `near` is a thousandth of the planes' weight.
    const auto pulled = [&](const glm::dvec3& p) { return q.at(p) + 1e-3 * q.trace() * glm::dot(p - near, p - near); };
    for (int i = 0; i < 20; ++i) {
      EXPECT_LE(pulled(*least), pulled(*least + 0.01 * random_vector(random)) + 1e-12) << "seed " << seed;
    }
    EXPECT_LE(q.at(*least), q.at(near) + 1e-12);
  }
}

TEST(Quadric, PlanesOfOneOrTwoDirectionsLeaveThePlaceOpen) {
  EXPECT_FALSE(least_anywhere(Quadric{}, glm::dvec3(0.0)));
  Quadric q;
  q.add_plane({1.0, 0.0, 0.0}, 0.25, 2.0);
  EXPECT_FALSE(least_anywhere(q, glm::dvec3(0.0)));
  q.add_plane({0.0, 0.8, 0.6}, 0.25, 2.0);
  EXPECT_FALSE(least_anywhere(q, glm::dvec3(0.0)));
  q.add_plane({0.0, -0.6, 0.8}, 0.25, 2.0);
  EXPECT_TRUE(least_anywhere(q, glm::dvec3(0.0)));
}

}  // namespace
}  // namespace fanstream
