#include "common/fans/fan_shape.h"

#include <gtest/gtest.h>

#include "tests/support/fan_test_meshes.h"

namespace fanstream {
namespace {

TEST(FanShape, TrianglesOfAFanMeshAreThoseItWasMadeFrom) {
  const TriangleMesh mesh = test::punch_holes(test::make_random_sphere(300, 2), 3);
  const auto fans = make_fan_mesh(mesh);
  ASSERT_TRUE(fans);
  const std::vector<Triangle> triangles = triangles_of(*fans);
  EXPECT_EQ(triangles.size(), mesh.triangles.size());
  const auto checked = check_cover(triangles, *cover_with_fans(mesh.positions.size(), mesh.triangles));
  EXPECT_TRUE(checked) << checked.error().message;
}

TEST(FanShape, TriangleFansAreTheTrianglesInTheirOrderWithTheSameNormals) {
  const TriangleMesh mesh = test::make_torus(20, 12);
  const FanMesh fans = make_triangle_fans(mesh);
  EXPECT_EQ(fans.fans.size(), mesh.triangles.size());
  EXPECT_TRUE(triangles_of(fans) == mesh.triangles);
  const auto covered = make_fan_mesh(mesh);
  ASSERT_TRUE(covered);
  ASSERT_EQ(fans.vertices.size(), covered->vertices.size());
  for (std::size_t i = 0; i < fans.vertices.size(); ++i) {
    EXPECT_EQ(fans.vertices[i].point, covered->vertices[i].point);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(fans.vertices[i].normal[axis], covered->vertices[i].normal[axis], 1e-4F);
    }
  }
}

TEST(FanShape, NormalsSetFromPointsAreThoseItWasMadeWith) {
  const TriangleMesh mesh = test::make_torus(20, 12);
  auto fans = make_fan_mesh(mesh);
  ASSERT_TRUE(fans);
  FanMesh again = *fans;
  for (Vertex& vertex : again.vertices) vertex.normal = glm::vec3(7.0F);
  set_normals(again);
  for (std::size_t i = 0; i < again.vertices.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(again.vertices[i].normal[axis], fans->vertices[i].normal[axis], 1e-4F);
    }
  }
}

}  // namespace
}  // namespace fanstream
