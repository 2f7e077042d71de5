#include "common/geometry/closest_point.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <random>

#include "tests/unit/common/geometry/geometry_shapes.h"

namespace fanstream {
namespace {

double distance_to(const glm::dvec3& query, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  return glm::distance(query, closest_point_on_triangle(query, a, b, c));
}

// An independent way: the distance to a convex set by ternary search over both barycentric coordinates, which works
// because the distance is convex along any line.
double searched_distance(const glm::dvec3& query, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  const auto along_row = [&](double s) {
    double low = 0.0;
    double high = 1.0;
    const auto at = [&](double t) { return glm::distance(query, a * (1 - s) + (b * (1 - t) + c * t) * s); };
    for (int i = 0; i < 60; ++i) {
      const double third = (high - low) / 3.0;
      (at(low + third) < at(high - third) ? high : low) += (at(low + third) < at(high - third) ? -third : third);
    }
    return at((low + high) * 0.5);
  };
  double low = 0.0;
  double high = 1.0;
  for (int i = 0; i < 60; ++i) {
    const double third = (high - low) / 3.0;
    (along_row(low + third) < along_row(high - third) ? high : low) +=
        (along_row(low + third) < along_row(high - third) ? -third : third);
  }
  return along_row((low + high) * 0.5);
}

TEST(ClosestPoint, AllSevenRegionsOfATriangleGiveTheExpectedPoint) {
  const glm::dvec3 a(0, 0, 0);
  const glm::dvec3 b(4, 0, 0);
  const glm::dvec3 c(0, 4, 0);
  const auto expect = [&](const glm::dvec3& query, const glm::dvec3& expected) {
    const glm::dvec3 found = closest_point_on_triangle(query, a, b, c);
    EXPECT_NEAR(glm::distance(found, expected), 0.0, 1e-14) << found.x << ' ' << found.y << ' ' << found.z;
  };
  expect({1, 1, 5}, {1, 1, 0});
  expect({-1, -2, 3}, a);
  expect({9, -1, 1}, b);
  expect({-1, 9, -1}, c);
  expect({2, -3, 1}, {2, 0, 0});
  expect({-3, 2, 1}, {0, 2, 0});
  expect({5, 5, 2}, {2, 2, 0});
}

TEST(ClosestPoint, AgreesWithASearchOverTheTriangleForAllShapes) {
  const TriangleMesh mesh = geometry_shapes::random_triangles(300, 5);
  std::mt19937_64 random(6);
  const auto uniform = [&random] { return static_cast<double>(random() >> 11) * 0x1.0p-52 - 1.0; };
  for (const Triangle& t : mesh.triangles) {
    SCOPED_TRACE(t[0] / 3);
    const glm::dvec3 query(uniform() * 2, uniform() * 2, uniform() * 2);
    const auto& p = mesh.positions;
    EXPECT_NEAR(distance_to(query, p[t[0]], p[t[1]], p[t[2]]), searched_distance(query, p[t[0]], p[t[1]], p[t[2]]),
                1e-7);
  }
}

TEST(ClosestPoint, DegenerateTrianglesAreTheSegmentOrPointThatTheyAre) {
  const glm::dvec3 query(1, 2, 2);
  const glm::dvec3 zero(0.0);
  EXPECT_DOUBLE_EQ(distance_to(query, zero, zero, zero), 3.0);
  const std::array<glm::dvec3, 3> line{glm::dvec3(-1, 0, 0), glm::dvec3(0.25, 0, 0), glm::dvec3(7, 0, 0)};
  std::array<int, 3> corner{0, 1, 2};
  do {
    const auto at = [&](std::size_t i) { return line[static_cast<std::size_t>(corner[i])]; };
    EXPECT_DOUBLE_EQ(distance_to(query, at(0), at(1), at(2)), std::sqrt(8.0));
    EXPECT_DOUBLE_EQ(distance_to({-3, 0, 0}, at(0), at(1), at(2)), 2.0);
    EXPECT_DOUBLE_EQ(distance_to({9, 0, 0}, at(0), at(1), at(2)), 2.0);
  } while (std::next_permutation(corner.begin(), corner.end()));
  EXPECT_DOUBLE_EQ(distance_to(query, zero, zero, {2, 0, 0}), std::sqrt(8.0));
}

// Needles are where formulas from differences of dot products break down: at a height of 1e-8 all of their digits are
// gone. Below 1e-15 the normal is noise, and so is where a query projects to. Turned at random, so that no coordinate
// is exact.
TEST(ClosestPoint, NeedlesKeepTheirAccuracyDownToNothing) {
  std::mt19937_64 random(11);
  const auto uniform = [&random] { return static_cast<double>(random() >> 11) * 0x1.0p-52 - 1.0; };
  for (const double height : {1e-2, 1e-4, 1e-6, 1e-8, 1e-9, 1e-11, 1e-13, 1e-15, 1e-16, 0.0}) {
    SCOPED_TRACE(height);
    for (int turn = 0; turn < 50; ++turn) {
      SCOPED_TRACE(turn);
      const glm::dvec3 along = glm::normalize(glm::dvec3(uniform(), uniform(), uniform()));
      const glm::dvec3 across = glm::normalize(glm::cross(along, glm::dvec3(uniform(), uniform(), uniform())));
      const glm::dvec3 up = glm::cross(along, across);
      const glm::dvec3 a(uniform(), uniform(), uniform());
      const glm::dvec3 b = a + along;
      const glm::dvec3 c = a + 0.4 * along + height * across;
      for (const double place : {0.05, 0.3, 0.4, 0.77, 0.99}) {
        SCOPED_TRACE(place);
        const glm::dvec3 query = a + place * along + 0.5 * up;
        EXPECT_NEAR(distance_to(query, a, b, c), 0.5, 1e-10);
        EXPECT_NEAR(distance_to(query, b, c, a), 0.5, 1e-10);
        EXPECT_NEAR(distance_to(query, c, a, b), 0.5, 1e-10);
      }
      EXPECT_NEAR(distance_to(a + 5.0 * along, a, b, c), 4.0, 1e-10);
    }
  }
}

TEST(ClosestPoint, TheAnswerAlwaysLiesOnTheTriangleEvenForFarQueries) {
  const glm::dvec3 a(0, 0, 0);
  const glm::dvec3 b(1e-3, 0, 0);
  const glm::dvec3 c(0, 1e-3, 0);
  for (const double far : {1e3, 1e9, 1e30, 1e60}) {
    const glm::dvec3 found = closest_point_on_triangle({far, 0.3 * far, -far}, a, b, c);
    EXPECT_NEAR(found.z, 0.0, 1e-18);
    EXPECT_GE(found.x, -1e-18);
    EXPECT_GE(found.y, -1e-18);
    EXPECT_LE(found.x + found.y, 1e-3 * (1 + 1e-12));
  }
}

}  // namespace
}  // namespace fanstream
