#include "server/build/merged_ring.h"

#include <gtest/gtest.h>

#include "tests/support/asset_helpers.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/ring_views.h"

namespace fanstream {
namespace {

template <class Use>
void for_each_edge(const TriangleMesh& mesh, Use use) {
  const RingMesh rings = RingMesh::from_triangles(mesh.positions.size(), mesh.triangles);
  for (VertexId root = 0; root < mesh.positions.size(); ++root) {
    for (const VertexId removed : rings.ring(root)) {
      if (removed != kOutside) use(rings, root, removed);
    }
  }
}

std::vector<std::pair<std::string, TriangleMesh>> shapes() {
  auto shapes = testing::model_shapes();
  std::vector<std::pair<std::string, TriangleMesh>> all(shapes.begin(), shapes.end());
  all.emplace_back("tetrahedron", testing::make_tetrahedron());
  all.emplace_back("triangle", TriangleMesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}});
  all.emplace_back("thin torus", testing::make_torus(3, 3));
  all.emplace_back("thin cylinder", testing::make_open_cylinder(3, 1));
  all.emplace_back("strip", testing::make_grid(6, 1));
  return all;
}

TEST(MergedRing, IsTheRingOfTheParent) {
  for (const auto& [name, mesh] : shapes()) {
    SCOPED_TRACE(name);
    for_each_edge(mesh, [](const RingMesh& rings, VertexId root, VertexId removed) {
      MergedRing ring;
      ring.assign(rings, root, removed);
      ASSERT_EQ(ring.is_mergeable(rings), rings.can_merge(root, removed)) << root << " and " << removed;
      if (!ring.is_mergeable(rings)) return;
      const RingMesh::Wings wings = rings.wings(root, removed);
      ASSERT_EQ(ring.id(0), wings.first);
      ASSERT_EQ(ring.id(ring.arc()), wings.last);
      RingMesh merged = rings;
      merged.merge(root, removed);
      ASSERT_EQ(testing::as_cycle(ring.ids()), testing::as_cycle(merged.ring(root)));
    });
  }
}

TEST(MergedRing, AFaceThatTurnsTooFarIsSeen) {
  // A flat hexagon around two centres.
  const TriangleMesh mesh = testing::make_grid(4, 4);
  const RingMesh rings = RingMesh::from_triangles(mesh.positions.size(), mesh.triangles);
  MergedRing ring;
  ring.assign(rings, 12, 11);
  ASSERT_TRUE(ring.is_mergeable(rings));
  ring.assign_places(mesh.positions);
  const glm::dvec3 root = mesh.positions[12];
  const glm::dvec3 removed = mesh.positions[11];
  EXPECT_FALSE(ring.is_open());
  EXPECT_TRUE(ring.removed_may_move(removed, root, 0.2));
  EXPECT_TRUE(ring.root_may_move(root, removed, 0.2));
  EXPECT_TRUE(ring.root_may_move(root, root + glm::dvec3(0, 0, 0.3), 0.2));
  EXPECT_FALSE(ring.root_may_move(root, root + glm::dvec3(0, 0, 0.3), 0.999));
  EXPECT_FALSE(ring.root_may_move(root, root + glm::dvec3(3, 0, 0), 0.2)) << "faces fold over";
}

TEST(MergedRing, CodingTakesLeastEffortAtTheMiddleOfTheOwnRing) {
  const TriangleMesh mesh = testing::make_grid(4, 4);
  const RingMesh rings = RingMesh::from_triangles(mesh.positions.size(), mesh.triangles);
  MergedRing ring;
  ring.assign(rings, 12, 11);
  ring.assign_places(mesh.positions);
  const glm::dvec3 root = mesh.positions[12];
  const glm::dvec3 middle = mesh.positions[11];
  EXPECT_NEAR(ring.coding_effort(root, middle, root).off_middle, 0.0, 1e-12);
  EXPECT_GT(ring.coding_effort(root, middle + glm::dvec3(0.3, 0, 0), root).off_middle, 0.01);
}

}  // namespace
}  // namespace fanstream
