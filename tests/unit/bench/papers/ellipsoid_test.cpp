#include "tests/bench/papers/ellipsoid.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "common/fans/vertex_stars.h"

namespace fanstream::bench {
namespace {

TEST(Ellipsoid, IsClosedFacesOutwardAndHas402Vertices) {
  for (const TriangleMesh& mesh : {make_ring_ellipsoid(), make_octahedral_ellipsoid()}) {
    ASSERT_EQ(mesh.positions.size(), 402U);
    ASSERT_EQ(mesh.triangles.size(), 800U);
    const auto stars = VertexStars::build(mesh.positions.size(), mesh.triangles);
    ASSERT_TRUE(stars) << stars.error().message;
    for (VertexId v = 0; v < mesh.positions.size(); ++v) {
      EXPECT_TRUE(stars->closed(v));
      EXPECT_NEAR(glm::length(mesh.positions[v] / glm::dvec3(1.0, 0.8, 0.6)), 1.0, 1e-12);
    }
    for (const Triangle& t : mesh.triangles) {
      const glm::dvec3& a = mesh.positions[t[0]];
      const glm::dvec3 normal = glm::cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a);
      EXPECT_GT(glm::dot(normal, a), 0.0);
    }
  }
}

}  // namespace
}  // namespace fanstream::bench
