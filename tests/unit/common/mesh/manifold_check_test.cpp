#include "common/mesh/manifold_check.h"

#include <gtest/gtest.h>

#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

using namespace fanstream::testing;

std::string complaint(const TriangleMesh& mesh) {
  std::string why;
  return is_oriented_manifold(mesh, &why) ? "" : why;
}

TEST(ManifoldCheck, GeneratedSurfacesAreOrientedManifolds) {
  EXPECT_EQ(complaint({}), "");
  EXPECT_EQ(complaint(make_tetrahedron()), "");
  EXPECT_EQ(complaint(make_sphere(2, 3)), "");
  EXPECT_EQ(complaint(make_sphere(9, 14)), "");
  EXPECT_EQ(complaint(make_torus(7, 5)), "");
  EXPECT_EQ(complaint(make_grid(1, 1)), "");
  EXPECT_EQ(complaint(make_terrain(12, 7, 1)), "");
  EXPECT_EQ(complaint(make_open_cylinder(3, 1)), "");
  EXPECT_EQ(complaint(make_open_cylinder(11, 4)), "");
  EXPECT_EQ(complaint(make_book(1)), "");
  EXPECT_EQ(complaint(explode(make_sphere(4, 5))), "");
  TriangleMesh two = make_sphere(4, 5);
  append(two, make_torus(4, 5), {3, 0, 0});
  EXPECT_EQ(complaint(two), "");
  EXPECT_EQ(complaint(shuffled(two, 7)), "");
}

TEST(ManifoldCheck, ClosedGeneratedSurfacesFaceOutward) {
  for (const TriangleMesh& mesh : {make_tetrahedron(), make_sphere(9, 14), make_torus(7, 5)}) {
    double volume = 0;
    for (const Triangle& t : mesh.triangles) {
      const glm::dvec3 &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
      volume += (a.x * (b.y * c.z - b.z * c.y) + a.y * (b.z * c.x - b.x * c.z) + a.z * (b.x * c.y - b.y * c.x)) / 6;
    }
    EXPECT_GT(volume, 0.5);
  }
}

TEST(ManifoldCheck, NamesAnIndexOutOfRange) {
  EXPECT_EQ(complaint({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 3}}}),
            "triangle 0 (0, 1, 3) names vertex 3, but there are only 3");
}

TEST(ManifoldCheck, NamesARepeatedCorner) {
  EXPECT_EQ(complaint({{{0, 0, 0}, {1, 0, 0}}, {{0, 1, 1}}}), "triangle 0 (0, 1, 1) repeats a corner");
}

TEST(ManifoldCheck, NamesAnUnusedVertex) {
  TriangleMesh mesh = make_tetrahedron();
  mesh.positions.emplace_back(9, 9, 9);
  EXPECT_EQ(complaint(mesh), "vertex 4 is used by no triangle");
}

TEST(ManifoldCheck, RefusesTwoTrianglesAlongOneDirectedEdge) {
  TriangleMesh mesh = make_tetrahedron();
  std::swap(mesh.triangles[2][0], mesh.triangles[2][1]);
  EXPECT_NE(complaint(mesh).find("in the same direction"), std::string::npos) << complaint(mesh);
  EXPECT_FALSE(is_oriented_manifold(make_book(3)));
  EXPECT_FALSE(is_oriented_manifold(make_moebius(8)));
}

TEST(ManifoldCheck, RefusesTwoFansAtOneVertex) {
  EXPECT_EQ(complaint(make_bowtie(2)), "the 4 faces around vertex 0 form more than one fan");
  // Two closed fans: tetrahedra that share a corner.
  TriangleMesh mesh = make_tetrahedron();
  append(mesh, make_tetrahedron(), {2, 2, 2});
  for (Triangle& t : mesh.triangles) {
    for (VertexId& v : t) v = v == 5 ? 0 : v > 5 ? v - 1 : v;
  }
  mesh.positions.erase(mesh.positions.begin() + 5);
  EXPECT_EQ(complaint(mesh), "the 6 faces around vertex 0 form more than one fan");
}

}  // namespace
}  // namespace fanstream
