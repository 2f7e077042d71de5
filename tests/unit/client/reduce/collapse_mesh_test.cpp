#include "client/reduce/collapse_mesh.h"

#include <gtest/gtest.h>

#include "common/mesh/manifold_check.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

TriangleMesh rest_of(const CollapseMesh& collapsing, const TriangleMesh& source) {
  TriangleMesh mesh;
  std::vector<VertexId> id(source.positions.size(), 0xFFFFFFFFU);
  for (HalfEdge h = 0; h < collapsing.half_edge_count(); h += 3) {
    if (!collapsing.is_live(h)) continue;
    Triangle t{};
    for (HalfEdge i = 0; i < 3; ++i) {
      const VertexId v = collapsing.origin(h + i);
      if (id[v] == 0xFFFFFFFFU) {
        id[v] = static_cast<VertexId>(mesh.positions.size());
        mesh.positions.push_back(source.positions[v]);
      }
      t[i] = id[v];
    }
    mesh.triangles.push_back(t);
  }
  return mesh;
}

long euler_of(const TriangleMesh& mesh) {
  const CollapseMesh edges(mesh);
  long count = 0;
  for (HalfEdge h = 0; h < edges.half_edge_count(); ++h) count += edges.edge_of(h) == h ? 1 : 0;
  return static_cast<long>(mesh.positions.size()) - count + static_cast<long>(mesh.triangles.size());
}

std::vector<TriangleMesh> shapes() {
  std::vector<TriangleMesh> shapes{testing::make_tetrahedron(),       testing::make_sphere(8, 12),
                                   testing::make_torus(12, 9),        testing::make_grid(7, 5),
                                   testing::make_open_cylinder(9, 5), testing::make_sphere(2, 40)};
  TriangleMesh several = testing::make_torus(8, 6);
  testing::append(several, testing::make_grid(3, 3), {5.0, 0.0, 0.0});
  testing::append(several, testing::make_tetrahedron(), {9.0, 0.0, 0.0});
  shapes.push_back(several);
  return shapes;
}

TEST(CollapseMesh, RandomMergesKeepManifoldAndTopologyDownToTheLast) {
  for (const TriangleMesh& shape : shapes()) {
    const long euler = euler_of(shape);
    const std::size_t components = count_components(shape.positions.size(), shape.triangles);
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      testing::SeededRandom random(seed);
      const TriangleMesh mesh = testing::shuffled(shape, seed);
      CollapseMesh collapsing(mesh);
      int refused = 0;
      int merged = 0;
      while (refused < 2000) {
        const HalfEdge h = random.below(collapsing.half_edge_count());
        if (!collapsing.is_live(h) || !collapsing.can_collapse(h)) {
          ++refused;
          continue;
        }
        refused = 0;
        const VertexId kept = random.one_in(2) ? collapsing.origin(h) : collapsing.target(h);
        const std::size_t before = collapsing.triangle_count();
        const std::size_t gone = collapsing.opposite(h) == kNoHalfEdge ? 1 : 2;
        const std::uint32_t faces = collapsing.faces_after(h);
        collapsing.collapse(h, kept);
        EXPECT_EQ(collapsing.triangle_count(), before - gone);
        std::uint32_t around = 0;
        collapsing.for_each_outgoing(kept, [&](HalfEdge g) {
          ++around;
          EXPECT_EQ(collapsing.origin(g), kept);
        });
        EXPECT_EQ(around, faces);
        EXPECT_EQ(collapsing.faces_around(kept), faces);
        if (++merged % 7 != 0) continue;
        std::string why;
        ASSERT_TRUE(is_oriented_manifold(rest_of(collapsing, mesh), &why)) << "seed " << seed << ": " << why;
      }
      const TriangleMesh rest = rest_of(collapsing, mesh);
      std::string why;
      EXPECT_TRUE(is_oriented_manifold(rest, &why)) << "seed " << seed << ": " << why;
      EXPECT_EQ(euler_of(rest), euler);
      EXPECT_EQ(count_components(rest.positions.size(), rest.triangles), components);
    }
  }
}

TEST(CollapseMesh, OppositeHalfEdgesRunTheOtherWay) {
  for (const TriangleMesh& mesh : shapes()) {
    const CollapseMesh edges(mesh);
    for (HalfEdge h = 0; h < edges.half_edge_count(); ++h) {
      const HalfEdge o = edges.opposite(h);
      if (o == kNoHalfEdge) {
        EXPECT_TRUE(edges.is_boundary(edges.origin(h)) && edges.is_boundary(edges.target(h)));
        continue;
      }
      EXPECT_EQ(edges.opposite(o), h);
      EXPECT_EQ(edges.origin(o), edges.target(h));
      EXPECT_EQ(edges.target(o), edges.origin(h));
      EXPECT_EQ(edges.edge_of(o), edges.edge_of(h));
    }
  }
}

TEST(CollapseMesh, TheLastOfAComponentIsRefused) {
  const TriangleMesh tetrahedron = testing::make_tetrahedron();
  CollapseMesh closed(tetrahedron);
  for (HalfEdge h = 0; h < 12; ++h) EXPECT_FALSE(closed.can_collapse(h));
  TriangleMesh one;
  one.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  one.triangles = {{0, 1, 2}};
  CollapseMesh open(one);
  for (HalfEdge h = 0; h < 3; ++h) EXPECT_FALSE(open.can_collapse(h));
}

}  // namespace
}  // namespace fanstream
