#include "common/mesh/polygon_triangulation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <numeric>

namespace fanstream {
namespace {

std::vector<Triangle> triangulate(const std::vector<glm::dvec3>& positions) {
  std::vector<VertexId> polygon(positions.size());
  std::iota(polygon.begin(), polygon.end(), VertexId{0});
  std::vector<Triangle> triangles;
  triangulate_polygon(positions, polygon, triangles);
  return triangles;
}

// Sums of the triangles' areas: with their sign as seen along +z, and without.
std::pair<double, double> areas(const std::vector<glm::dvec3>& p, const std::vector<Triangle>& triangles) {
  double with_sign = 0;
  double without = 0;
  for (const Triangle& t : triangles) {
    const double area = glm::cross(p[t[1]] - p[t[0]], p[t[2]] - p[t[0]]).z / 2;
    with_sign += area;
    without += std::abs(area);
  }
  return {with_sign, without};
}

TEST(PolygonTriangulation, ConvexPolygonsBecomeFansOfTheirFirstCorner) {
  EXPECT_EQ(triangulate({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}), (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
}

TEST(PolygonTriangulation, ConcavePolygonsAreCoveredOnceAndKeepTheirWinding) {
  // An L, whose fan from corner 0 would be right, and rotations of it, whose fan would reach outside.
  std::vector<glm::dvec3> corners = {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}, {1, 2, 0}, {0, 2, 0}};
  for (std::size_t turn = 0; turn < corners.size(); ++turn) {
    std::rotate(corners.begin(), corners.begin() + 1, corners.end());
    const std::vector<Triangle> triangles = triangulate(corners);
    EXPECT_EQ(triangles.size(), 4U);
    const auto [with_sign, without] = areas(corners, triangles);
    EXPECT_DOUBLE_EQ(with_sign, 3);
    EXPECT_DOUBLE_EQ(without, 3);
  }
  // A star of 50 points, clockwise.
  std::vector<glm::dvec3> star;
  double area = 0;
  for (int i = 0; i < 100; ++i) {
    const double radius = i % 2 == 0 ? 1.0 : 0.3;
    star.emplace_back(radius * std::cos(-i * std::numbers::pi / 50), radius * std::sin(-i * std::numbers::pi / 50), 0);
    area -= 0.5 * 0.3 * std::sin(std::numbers::pi / 50);
  }
  const auto [with_sign, without] = areas(star, triangulate(star));
  EXPECT_NEAR(with_sign, area, 1e-12);
  EXPECT_NEAR(without, -area, 1e-12);
}

TEST(PolygonTriangulation, WorksInAnyPlane) {
  const std::vector<glm::dvec3> flat = {{0, 0, 0}, {2, 0, 0}, {0.5, 0.5, 0}, {0, 2, 0}};
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {1.0, -1.0}) {
      std::vector<glm::dvec3> turned;
      for (const glm::dvec3& p : flat) {
        glm::dvec3 q(0);
        q[axis] = p.x;
        q[(axis + 1) % 3] = side * p.y;
        turned.push_back(q);
      }
      // The reflex corner 2 must be an end of the only diagonal.
      for (const Triangle& t : triangulate(turned)) EXPECT_NE(std::find(t.begin(), t.end(), 2U), t.end());
    }
  }
}

TEST(PolygonTriangulation, AnyPolygonGivesAsManyTrianglesAsItShould) {
  const std::vector<glm::dvec3> crossed = {{0, 0, 0}, {2, 2, 0}, {2, 0, 0}, {0, 2, 0}, {1, 3, 0}, {-1, 1, 0}};
  EXPECT_EQ(triangulate(crossed).size(), 4U);
  EXPECT_EQ(triangulate(std::vector<glm::dvec3>(7, glm::dvec3(1, 2, 3))).size(), 5U);
  EXPECT_EQ(triangulate({{0, 0, 0}, {1, 0, 0}}).size(), 0U);
  EXPECT_EQ(triangulate({}).size(), 0U);
  std::vector<glm::dvec3> zigzag;
  for (int i = 0; i < 100'000; ++i) zigzag.emplace_back(i, i % 2 * 5, 0);
  EXPECT_EQ(triangulate(zigzag).size(), 99'998U);
}

}  // namespace
}  // namespace fanstream
