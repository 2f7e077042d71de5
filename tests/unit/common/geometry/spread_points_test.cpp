#include "common/geometry/spread_points.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "common/geometry/closest_point.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

TEST(SpreadPoints, LieInTheirFacesInOrder) {
  const TriangleMesh mesh = testing::make_torus(30, 20);
  const std::vector<SpreadPoint> points = spread_points(mesh, 5'000);
  ASSERT_EQ(points.size(), 5'000U);
  std::uint32_t last = 0;
  for (const SpreadPoint& p : points) {
    ASSERT_LT(p.face, mesh.triangles.size());
    EXPECT_GE(p.face, last);
    last = p.face;
    const Triangle& t = mesh.triangles[p.face];
    TriangleMesh face;
    face.positions = {mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]};
    face.triangles = {{0, 1, 2}};
    const glm::dvec3 a = face.positions[0];
    const glm::dvec3 u = face.positions[1] - a;
    const glm::dvec3 v = face.positions[2] - a;
    const glm::dvec3 n = glm::cross(u, v);
    const double share_u = glm::dot(glm::cross(p.place - a, v), n) / glm::dot(n, n);
    const double share_v = glm::dot(glm::cross(u, p.place - a), n) / glm::dot(n, n);
    EXPECT_GE(share_u, -1e-12);
    EXPECT_GE(share_v, -1e-12);
    EXPECT_LE(share_u + share_v, 1.0 + 1e-12);
    EXPECT_NEAR(glm::length(a + share_u * u + share_v * v - p.place), 0.0, 1e-12);
  }
}

TEST(SpreadPoints, FallToFacesByArea) {
  const TriangleMesh mesh = testing::make_terrain(20, 15, 3);
  constexpr std::size_t kCount = 20'000;
  std::vector<double> found(mesh.triangles.size(), 0.0);
  for (const SpreadPoint& p : spread_points(mesh, kCount)) found[p.face] += 1.0;
  double all = 0.0;
  for (const Triangle& t : mesh.triangles) all += area_of(mesh, t);
  for (std::size_t f = 0; f < found.size(); ++f) {
    EXPECT_NEAR(found[f], kCount * area_of(mesh, mesh.triangles[f]) / all, 1.0) << "face " << f;
  }
}

TEST(SpreadPoints, SurfacesWithoutAreaHaveSome) {
  EXPECT_TRUE(spread_points({}, 10).empty());
  TriangleMesh line;
  line.positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  line.triangles = {{0, 1, 2}};
  EXPECT_EQ(spread_points(line, 10).size(), 10U);
}

}  // namespace
}  // namespace fanstream
