#include "common/mesh/mesh_hash.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

TEST(MeshHash, TheOrderOfVerticesFacesAndCornersDoesNotMatter) {
  const TriangleMesh mesh = testing::make_torus(12, 9);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    EXPECT_EQ(mesh_hash(testing::shuffled(mesh, seed)), mesh_hash(mesh));
  }
  EXPECT_EQ(mesh_hash(mesh).size(), 32U);
}

TEST(MeshHash, EveryChangeOfAFaceShows) {
  const TriangleMesh mesh = testing::make_torus(12, 9);
  const std::string hash = mesh_hash(mesh);
  TriangleMesh turned = mesh;
  std::swap(turned.triangles[17][0], turned.triangles[17][1]);
  EXPECT_NE(mesh_hash(turned), hash);
  TriangleMesh less = mesh;
  less.triangles.pop_back();
  EXPECT_NE(mesh_hash(less), hash);
  TriangleMesh twice = mesh;
  twice.triangles[3] = twice.triangles[4];
  EXPECT_NE(mesh_hash(twice), hash);
  TriangleMesh moved = mesh;
  moved.positions[20].y = std::nextafter(moved.positions[20].y, 9.0);
  EXPECT_NE(mesh_hash(moved), hash);
  TriangleMesh more = mesh;
  more.positions.emplace_back(0.0);
  EXPECT_NE(mesh_hash(more), hash) << "a vertex without faces";
}

TEST(MeshHash, TheSignOfZeroDoesNotMatter) {
  TriangleMesh mesh = testing::make_grid(2, 2);
  const std::string hash = mesh_hash(mesh);
  for (glm::dvec3& p : mesh.positions) p.z = -0.0;
  EXPECT_EQ(mesh_hash(mesh), hash);
}

}  // namespace
}  // namespace fanstream
