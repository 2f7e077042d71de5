#include "common/mesh/polygon_mesh.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "common/mesh/manifold_check.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/polygon_meshes.h"

namespace fanstream {
namespace {

using namespace fanstream::testing;

double area_of(const TriangleMesh& mesh) {
  double area = 0;
  for (const Triangle& t : mesh.triangles) {
    area += glm::length(
                glm::cross(mesh.positions[t[1]] - mesh.positions[t[0]], mesh.positions[t[2]] - mesh.positions[t[0]])) /
            2;
  }
  return area;
}

TEST(PolygonMesh, TrianglesSurviveTheRoundTrip) {
  const TriangleMesh mesh = make_sphere(7, 9);
  const TriangleMesh same = triangle_mesh(polygon_mesh(mesh));
  EXPECT_EQ(same.positions, mesh.positions);
  EXPECT_EQ(same.triangles, mesh.triangles);
}

TEST(PolygonMesh, AFaceOfNCornersGivesNMinusTwoTriangles) {
  const PolygonMesh mesh = with_dissolved_edges(polygon_mesh(make_torus(12, 9)), 0.4, 2);
  std::vector<FaceId> faces;
  const TriangleMesh triangles = triangle_mesh(mesh, &faces);
  EXPECT_TRUE(is_oriented_manifold(triangles));
  ASSERT_EQ(faces.size(), triangles.triangles.size());
  std::vector<std::size_t> count(mesh.face_count(), 0);
  for (const FaceId f : faces) ++count[f];
  for (FaceId f = 0; f < mesh.face_count(); ++f) EXPECT_EQ(count[f], mesh.face(f).size() - 2);
}

// The wrong diagonal would draw outside the quad, and twice.
TEST(PolygonMesh, AConcaveQuadIsCutInside) {
  for (unsigned first = 0; first < 4; ++first) {
    PolygonMesh mesh;
    mesh.points = {{0, 0, 0, 1}, {4, 0, 0, 1}, {1, 1, 0, 1}, {0, 4, 0, 1}};
    mesh.add_face(std::array<VertexId, 4>{first % 4, (first + 1) % 4, (first + 2) % 4, (first + 3) % 4});
    EXPECT_NEAR(area_of(triangle_mesh(mesh)), 4.0, 1e-12);
  }
}

TEST(PolygonMesh, PlacesAreDividedByTheWeights) {
  const PolygonMesh mesh = make_cube();
  const PolygonMesh weighted = with_random_weights(mesh, 1);
  const auto plain = positions(mesh.points);
  const auto same = positions(weighted.points);
  for (std::size_t v = 0; v < plain.size(); ++v) EXPECT_LT(glm::length(plain[v] - same[v]), 1e-15);
}

}  // namespace
}  // namespace fanstream
