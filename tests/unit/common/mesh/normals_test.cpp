#include "common/mesh/normals.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "tests/support/fan_test_meshes.h"

namespace fanstream {
namespace {

// A cube with corners at +-1, each side cut along a diagonal.
TriangleMesh make_cube() {
  TriangleMesh cube;
  for (int i = 0; i < 8; ++i) cube.positions.emplace_back((i & 1) * 2 - 1, (i & 2) - 1, (i & 4) / 2 - 1);
  cube.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return cube;
}

TEST(VertexNormals, OfACubePointAlongItsDiagonalsHoweverTheSidesAreCut) {
  const TriangleMesh cube = make_cube();
  const auto normals = vertex_normals(cube.positions, cube.triangles, {180.0});
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_NEAR(glm::distance(glm::dvec3(normals[i]), glm::normalize(cube.positions[i])), 0.0, 1e-6) << i;
  }
}

TEST(VertexNormals, VanishAtCreases) {
  const TriangleMesh cube = make_cube();
  for (const glm::vec3& normal : vertex_normals(cube.positions, cube.triangles)) EXPECT_EQ(normal, glm::vec3(0.0F));
}

TEST(VertexNormals, OfAFineTorusAreUnitAndPointOutwards) {
  const TriangleMesh torus = test::make_torus(60, 40);
  const auto normals = vertex_normals(torus.positions, torus.triangles);
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const glm::dvec3 p = torus.positions[i];
    const glm::dvec3 outward = glm::normalize(p - 2.0 * glm::normalize(glm::dvec3(p.x, p.y, 0.0)));
    EXPECT_NEAR(glm::length(normals[i]), 1.0F, 1e-5F);
    EXPECT_GT(glm::dot(glm::dvec3(normals[i]), outward), 0.995) << i;
  }
}

TEST(VertexNormals, AreZeroWhereThereIsNoSurface) {
  const std::vector<glm::dvec3> positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {5, 5, 5}};
  const std::vector<Triangle> sliver = {{0, 1, 2}};
  for (const glm::vec3& normal : vertex_normals(positions, sliver)) EXPECT_EQ(normal, glm::vec3(0.0F));
}

}  // namespace
}  // namespace fanstream
