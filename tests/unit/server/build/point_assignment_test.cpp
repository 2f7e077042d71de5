#include "server/build/point_assignment.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <map>

#include "common/geometry/closest_point.h"
#include "server/build/simplifier.h"
#include "tests/support/asset_helpers.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

TEST(PointAssignment, AllVerticesAndSoManySamplesLieOnTheSurface) {
  const TriangleMesh mesh = testing::make_torus(20, 15);
  const PointAssignment points(mesh, 500, 7);
  ASSERT_EQ(points.point_count(), mesh.positions.size() + 500);
  for (std::uint32_t p = 0; p < points.point_count(); ++p) {
    const Triangle& t = points.corners(points.face_of(p));
    const glm::dvec3 nearest =
        closest_point_on_triangle(points.point(p), mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]);
    EXPECT_LE(glm::distance(nearest, points.point(p)), 1e-12);
  }
}

TEST(PointAssignment, TheSameSeedGivesTheSameSamplesAnotherOthers) {
  const TriangleMesh mesh = testing::make_torus(20, 15);
  const PointAssignment a(mesh, 100, 7);
  const PointAssignment b(mesh, 100, 7);
  const PointAssignment c(mesh, 100, 8);
  std::size_t differs = 0;
  for (std::uint32_t p = 0; p < a.point_count(); ++p) {
    EXPECT_EQ(a.point(p), b.point(p));
    differs += a.point(p) == c.point(p) ? 0 : 1;
  }
  EXPECT_EQ(differs, 100U);
}

TEST(PointAssignment, SamplesAreSpreadByArea) {
  TriangleMesh mesh = testing::make_grid(1, 1);  // two triangles, one of them made thrice as large
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {3, 3, 0}};
  mesh.triangles = {Triangle{0, 1, 2}, Triangle{1, 3, 2}};
  const double small = 0.5;
  const double large = 0.5 * glm::length(glm::cross(glm::dvec3(2, 3, 0), glm::dvec3(-1, 1, 0)));
  const PointAssignment points(mesh, 20'000, 3);
  double in_large = 0.0;
  for (std::uint32_t p = 4; p < points.point_count(); ++p) in_large += points.face_of(p) == 1 ? 1.0 : 0.0;
  EXPECT_NEAR(in_large / 20'000.0, large / (small + large), 0.02);
}

TEST(PointAssignment, ASurfaceWithoutAreaHasItsVerticesOnly) {
  TriangleMesh mesh = testing::make_grid(3, 3);
  for (glm::dvec3& p : mesh.positions) p = {p.x, 0.0, 0.0};
  EXPECT_EQ(PointAssignment(mesh, 100, 1).point_count(), mesh.positions.size());
}

// After every merge each point is with one face, which is there, and with the nearest of those around the parent if it
// was with one of the faces that changed.
TEST(PointAssignment, MergesHandPointsToTheNearestFaceAround) {
  for (const auto& [name, mesh] : testing::model_shapes()) {
    SCOPED_TRACE(name);
    SimplifyOptions options;
    options.base_vertices = 60;
    const MergeHistory history = simplify(mesh, options);
    PointAssignment points(mesh, 200, 5);
    std::vector<glm::dvec3> places = mesh.positions;
    RingMesh rings = RingMesh::from_triangles(mesh.positions.size(), mesh.triangles);
    std::size_t made = 0;
    for (const MergeRecord& merge : history.merges) {
      if (++made > 150) break;
      if (merge.parent == ParentPosition::added) places[merge.root] = places[merge.removed];
      rings.merge(merge.root, merge.removed);
      points.merge(merge.root, merge.removed, places);
      std::map<VertexId, std::vector<Triangle>> around;
      for (std::uint32_t p = 0; p < points.point_count(); ++p) {
        const Triangle& t = points.corners(points.face_of(p));
        for (const VertexId v : t) ASSERT_NE(v, merge.removed) << "merge " << made;
        if (t[0] != merge.root) continue;  // merged faces begin with their parent
        const auto distance = [&](VertexId from, VertexId to) {
          return glm::distance(points.point(p), closest_point_on_triangle(points.point(p), places[merge.root],
                                                                          places[from], places[to]));
        };
        const double own = distance(t[1], t[2]);
        const auto ring = rings.ring(merge.root);
        for (std::size_t i = 0; i < ring.size(); ++i) {
          const VertexId next = ring[(i + 1) % ring.size()];
          if (ring[i] == kOutside || next == kOutside) continue;
          ASSERT_LE(own, distance(ring[i], next) + 1e-12) << "merge " << made << ", point " << p;
        }
      }
    }
  }
}

}  // namespace
}  // namespace fanstream
