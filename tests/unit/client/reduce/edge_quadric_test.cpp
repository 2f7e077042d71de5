#include "client/reduce/edge_quadric.h"

#include <gtest/gtest.h>

#include <array>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

glm::dvec3 random_point(testing::SeededRandom& random) {
  return {2.0 * random.unit() - 1.0, 2.0 * random.unit() - 1.0, 2.0 * random.unit() - 1.0};
}

struct Planes {
  std::vector<std::array<double, 5>> list;  // normal, offset, weight
  Quadric quadric;
  void add(const glm::dvec3& normal, double offset, double weight) {
    list.push_back({normal.x, normal.y, normal.z, offset, weight});
    quadric.add_plane(normal, offset, weight);
  }
  // Straight from the definition.
  double cost(const glm::dvec3& p) const {
    double sum = 0.0;
    for (const auto& [x, y, z, d, w] : list) {
      const double distance = x * p.x + y * p.y + z * p.z + d;
      sum += w * distance * distance;
    }
    return sum;
  }
};

TEST(EdgeQuadric, CostIsTheWeightedSumOfSquaredDistances) {
  testing::SeededRandom random(1);
  for (int i = 0; i < 200; ++i) {
    Planes planes;
    for (int k = 0; k < 8; ++k) planes.add(glm::normalize(random_point(random)), random.unit() - 0.5, random.unit());
    const glm::dvec3 p = random_point(random);
    EXPECT_NEAR(planes.quadric.at(p), planes.cost(p), 1e-12) << "round " << i;
  }
}

TEST(EdgeQuadric, NoPointOfTheSegmentCostsLessThanThatOfTheClosedForm) {
  testing::SeededRandom random(2);
  int inside = 0;
  for (int i = 0; i < 500; ++i) {
    const glm::dvec3 p0 = random_point(random);
    const glm::dvec3 p1 = random_point(random);
    Planes planes;
    // Through random points near the edge, so that the best place is often inside of it.
    for (int k = 0; k < 6; ++k) {
      const glm::dvec3 n = glm::normalize(random_point(random));
      const glm::dvec3 through = p0 + random.unit() * (p1 - p0) + 0.1 * random_point(random);
      planes.add(n, -glm::dot(n, through), 0.1 + random.unit());
    }
    const EdgePlace place = place_on_edge(planes.quadric, p0, p1);
    ASSERT_GE(place.k, 0.0);
    ASSERT_LE(place.k, 1.0);
    EXPECT_NEAR(place.cost, planes.cost(p0 + place.k * (p1 - p0)), 1e-12);
    for (int s = 0; s <= 1000; ++s) {
      ASSERT_GE(planes.cost(p0 + s * 1e-3 * (p1 - p0)), place.cost - 1e-12) << "round " << i << ", k " << s * 1e-3;
    }
    inside += place.k > 0.0 && place.k < 1.0 ? 1 : 0;
  }
  EXPECT_GT(inside, 250);
}

TEST(EdgeQuadric, TheFormulaIsTheSourcesInHomogeneousCoordinates) {
  testing::SeededRandom random(3);
  for (int i = 0; i < 100; ++i) {
    const glm::dvec3 p0 = random_point(random);
    const glm::dvec3 p1 = random_point(random);
    Planes planes;
    for (int k = 0; k < 5; ++k) planes.add(glm::normalize(random_point(random)), random.unit() - 0.5, 1.0);
    std::array<std::array<double, 4>, 4> a{};  // sum of n^T n
    for (const auto& plane : planes.list) {
      for (std::size_t r = 0; r < 4; ++r) {
        for (std::size_t c = 0; c < 4; ++c) a[r][c] += plane[r] * plane[c];
      }
    }
    const glm::dvec4 u(p1 - p0, 0.0);
    const glm::dvec4 p(p0, 1.0);
    const auto product = [&](const glm::dvec4& left, const glm::dvec4& right) {
      double sum = 0.0;
      for (int r = 0; r < 4; ++r) {
        for (int c = 0; c < 4; ++c)
          sum += left[r] * a[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)] * right[c];
      }
      return sum;
    };
    const double k = -(product(u, p) + product(p, u)) / (2.0 * product(u, u));
    EXPECT_NEAR(place_on_edge(planes.quadric, p0, p1).k, std::clamp(k, 0.0, 1.0), 1e-9) << "round " << i;
  }
}

TEST(EdgeQuadric, PlanesOfTheEdgeItselfAddNothingAlongIt) {
  const glm::dvec3 p0(0.0), p1(1.0, 0.0, 0.0);
  Planes around;
  around.add({0.6, 0.8, 0.0}, -0.3, 1.0);
  const EdgePlace before = place_on_edge(around.quadric, p0, p1);
  around.add({0.0, 0.0, 1.0}, 0.0, 5.0);
  around.add({0.0, 1.0, 0.0}, 0.0, 5.0);
  const EdgePlace after = place_on_edge(around.quadric, p0, p1);
  EXPECT_DOUBLE_EQ(before.k, after.k);
  EXPECT_DOUBLE_EQ(before.cost, after.cost);
}

TEST(EdgeQuadric, FlatAndBrokenNeighbourhoodsHaveADefinedPlace) {
  const glm::dvec3 p0(0.0), p1(1.0, 0.0, 0.0);
  EXPECT_EQ(place_on_edge({}, p0, p1).k, 0.5);  // no planes at all
  EXPECT_EQ(place_on_edge({}, p0, p1).cost, 0.0);
  Quadric flat;
  for (int i = 0; i < 6; ++i) flat.add_plane({0.0, 0.0, 1.0}, -0.25, 1.0 / 3.0);
  EXPECT_EQ(place_on_edge(flat, p0, p1).k, 0.5);
  EXPECT_NEAR(place_on_edge(flat, p0, p1).cost, 2.0 * 0.0625, 1e-15);
  EXPECT_EQ(place_on_edge(flat, p0, p0).k, 0.5);  // an edge without length
  Quadric broken;
  broken.add_plane({1.0, 0.0, 0.0}, NAN, 1.0);
  const EdgePlace place = place_on_edge(broken, p0, p1);
  EXPECT_TRUE(place.k >= 0.0 && place.k <= 1.0);
  EXPECT_EQ(place.cost, HUGE_VAL);
}

TEST(EdgeQuadric, TheEndsOfAnEdgeComeOutExactly) {
  const glm::dvec2 a(0.1, 1e300), b(1.0 / 3.0, -1e300);
  EXPECT_EQ(on_edge(a, b, 0.0), a);
  EXPECT_EQ(on_edge(a, b, 1.0), b);
  const glm::vec4 c(0.1F), d(0.7F);
  EXPECT_EQ(on_edge(c, d, 1.0), d);
  EXPECT_FLOAT_EQ(on_edge(c, d, 0.25).x, 0.25F);
}

}  // namespace
}  // namespace fanstream
