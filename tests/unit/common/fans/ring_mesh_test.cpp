#include "common/fans/ring_mesh.h"

#include <gtest/gtest.h>

#include <tuple>

#include "common/mesh/manifold_check.h"
#include "tests/support/fan_test_meshes.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/ring_views.h"
#include "tests/support/seeded_random.h"
#include "tests/unit/common/fans/fan_shapes.h"

namespace fanstream {
namespace {

using testing::as_cycle;
using testing::compact_faces;
using testing::cycles_of;
using testing::SeededRandom;

RingMesh rings_of(const TriangleMesh& mesh) { return RingMesh::from_triangles(mesh.positions.size(), mesh.triangles); }

void expect_manifold(const RingMesh& rings) {
  std::string why;
  ASSERT_TRUE(is_oriented_manifold(compact_faces(rings), &why)) << why;
}

struct Merged {
  VertexId root, removed, first, last;
  std::vector<std::vector<VertexId>> before;
};

// Merges at random until nothing more is found.
std::vector<Merged> merge_at_random(RingMesh& rings, SeededRandom& random) {
  std::vector<Merged> made;
  for (int misses = 0; misses < 400;) {
    const VertexId root = random.below(rings.vertex_capacity());
    if (!rings.contains(root)) {
      ++misses;
      continue;
    }
    const VertexId removed = rings.ring(root)[random.below(rings.ring_size(root))];
    if (removed == kOutside || !rings.can_merge(root, removed)) {
      ++misses;
      continue;
    }
    misses = 0;
    const RingMesh::Wings wings = rings.wings(root, removed);
    made.push_back({root, removed, wings.first, wings.last, cycles_of(rings)});
    rings.merge(root, removed);
  }
  return made;
}

TEST(RingMesh, HoldsTheTrianglesItWasMadeFrom) {
  for (const auto& [name, mesh] : testing::fan_shapes()) {
    SCOPED_TRACE(name);
    const RingMesh rings = rings_of(mesh);
    std::vector<Triangle> expected = mesh.triangles;
    for (Triangle& t : expected) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    std::vector<Triangle> found = rings.triangles();
    std::sort(expected.begin(), expected.end());
    std::sort(found.begin(), found.end());
    EXPECT_EQ(found, expected);
  }
}

TEST(RingMesh, LegalMergesKeepAnOrientedManifold) {
  for (const auto& [name, mesh] : testing::fan_shapes()) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      SCOPED_TRACE(name + ", seed " + std::to_string(seed));
      SeededRandom random(seed);
      RingMesh rings = rings_of(mesh);
      const std::vector<Merged> made = merge_at_random(rings, random);
      expect_manifold(rings);
      // Replayed, so that every mesh on the way is looked at too.
      RingMesh again = rings_of(mesh);
      std::size_t faces = mesh.triangles.size();
      for (const Merged& merge : made) {
        again.merge(merge.root, merge.removed);
        expect_manifold(again);
        faces -= static_cast<std::size_t>(merge.first != kOutside) + static_cast<std::size_t>(merge.last != kOutside);
        ASSERT_EQ(again.triangles().size(), faces);
      }
      ASSERT_EQ(count_components(mesh.positions.size(), mesh.triangles),
                count_components(compact_faces(again).positions.size(), compact_faces(again).triangles));
    }
  }
}

TEST(RingMesh, SplitsUndoMergesExactly) {
  for (const auto& [name, mesh] : testing::fan_shapes()) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      SCOPED_TRACE(name + ", seed " + std::to_string(seed));
      SeededRandom random(seed);
      RingMesh rings = rings_of(mesh);
      std::vector<Merged> made = merge_at_random(rings, random);
      while (!made.empty()) {
        const Merged& merge = made.back();
        rings.split(merge.root, merge.removed, rings.position_in_ring(merge.root, merge.first),
                    rings.position_in_ring(merge.root, merge.last));
        ASSERT_EQ(cycles_of(rings), merge.before) << "merge " << made.size();
        made.pop_back();
      }
    }
  }
}

TEST(RingMesh, AnySplitMakesAManifoldThatMergesBack) {
  for (const auto& [name, mesh] : testing::fan_shapes()) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      SCOPED_TRACE(name + ", seed " + std::to_string(seed));
      SeededRandom random(seed);
      RingMesh rings = rings_of(mesh);
      std::vector<std::tuple<VertexId, VertexId, std::vector<std::vector<VertexId>>>> made;
      for (int step = 0; step < 60; ++step) {
        const VertexId root = random.below(rings.vertex_capacity());
        const std::uint32_t size = rings.ring_size(root);
        const std::uint32_t first = random.below(size);
        const std::uint32_t last = (first + 1 + random.below(size - 1)) % size;
        const auto added = static_cast<VertexId>(rings.vertex_capacity());
        made.emplace_back(root, added, cycles_of(rings));
        const RingMesh::Wings expected{rings.ring(root)[first], rings.ring(root)[last]};
        rings.split(root, added, first, last);
        expect_manifold(rings);
        const RingMesh::Wings wings = rings.wings(root, added);
        ASSERT_EQ(wings.first, expected.first);
        ASSERT_EQ(wings.last, expected.last);
      }
      for (; !made.empty(); made.pop_back()) {
        const auto& [root, added, before] = made.back();
        ASSERT_TRUE(rings.can_merge(root, added));
        rings.merge(root, added);
        ASSERT_EQ(cycles_of(rings), before);
        ASSERT_FALSE(rings.contains(added));
      }
    }
  }
}

// The fan of a closed or open centre 0 whose rim is 1..sides.
TriangleMesh fan(std::uint32_t sides, bool closed) {
  TriangleMesh mesh;
  mesh.positions.resize(sides + 1);
  for (VertexId i = 1; i < sides; ++i) mesh.triangles.push_back({0, i, i + 1});
  if (closed) mesh.triangles.push_back({0, sides, 1});
  return mesh;
}

TEST(RingMesh, AWingAtTheOutsideInsertsOneFace) {
  RingMesh rings = rings_of(fan(4, false));
  ASSERT_TRUE(rings.is_boundary(0));
  const std::uint32_t gap = rings.position_in_ring(0, kOutside);
  rings.split(0, 9, gap, rings.position_in_ring(0, 2));
  EXPECT_EQ(rings.triangles().size(), 4U);  // three and one
  EXPECT_EQ(as_cycle(rings.ring(9)), (std::vector<VertexId>{0, kOutside, 1, 2}));
  EXPECT_EQ(as_cycle(rings.ring(0)), (std::vector<VertexId>{2, 3, 4, kOutside, 9}));
  expect_manifold(rings);
}

TEST(RingMesh, TwoWingsMayGiveTheOpeningToTheNewVertex) {
  RingMesh rings = rings_of(fan(4, false));
  rings.split(0, 9, rings.position_in_ring(0, 3), rings.position_in_ring(0, 2));
  EXPECT_FALSE(rings.is_boundary(0));
  EXPECT_TRUE(rings.is_boundary(9));
  EXPECT_EQ(as_cycle(rings.ring(0)), (std::vector<VertexId>{2, 3, 9}));
  EXPECT_EQ(as_cycle(rings.ring(9)), (std::vector<VertexId>{0, 3, 4, kOutside, 1, 2}));
  expect_manifold(rings);
  ASSERT_TRUE(rings.can_merge(0, 9));
  rings.merge(0, 9);
  EXPECT_EQ(cycles_of(rings), cycles_of(rings_of(fan(4, false))));
}

TEST(RingMesh, AnEarHasTheRootAndOneNeighbour) {
  RingMesh rings = rings_of(fan(3, false));
  const std::uint32_t gap = rings.position_in_ring(0, kOutside);
  rings.split(0, 9, gap, (gap + 1) % rings.ring_size(0));
  EXPECT_EQ(as_cycle(rings.ring(9)), (std::vector<VertexId>{0, kOutside, 1}));
  EXPECT_EQ(rings.triangles().size(), 3U);
  expect_manifold(rings);
  ASSERT_TRUE(rings.can_merge(0, 9));
  rings.merge(0, 9);
  EXPECT_EQ(cycles_of(rings), cycles_of(rings_of(fan(3, false))));
}

TEST(RingMesh, NeighbouringWingsMakeAVertexOfValence3) {
  RingMesh rings = rings_of(testing::make_tetrahedron());
  const auto before = cycles_of(rings);
  for (std::uint32_t first = 0; first < 3; ++first) {
    rings.split(0, 4, first, (first + 1) % 3);
    EXPECT_EQ(rings.ring_size(4), 3U);
    EXPECT_EQ(rings.ring_size(0), 4U);
    expect_manifold(rings);
    rings.merge(0, 4);
    EXPECT_EQ(cycles_of(rings), before);
  }
}

void expect_no_merge(const TriangleMesh& mesh) {
  const RingMesh rings = rings_of(mesh);
  for (VertexId a = 0; a < mesh.positions.size(); ++a) {
    for (VertexId b = 0; b < mesh.positions.size(); ++b) EXPECT_FALSE(rings.can_merge(a, b)) << a << " and " << b;
  }
}

TEST(RingMesh, RefusesToMergeATetrahedron) { expect_no_merge(testing::make_tetrahedron()); }

TEST(RingMesh, RefusesToMergeALoneTriangle) { expect_no_merge({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}}); }

TEST(RingMesh, RefusesToPinchTwoBoundaries) {
  expect_no_merge([] {
    TriangleMesh mesh = testing::make_open_cylinder(3, 1);  // also: its loops of three must not close
    return mesh;
  }());
  const TriangleMesh cylinder = testing::make_open_cylinder(6, 1);
  const RingMesh rings = rings_of(cylinder);
  for (VertexId low = 0; low < 6; ++low) {
    for (VertexId high = 6; high < 12; ++high) EXPECT_FALSE(rings.can_merge(low, high)) << low << " and " << high;
    EXPECT_TRUE(rings.can_merge(low, (low + 1) % 6));
  }
}

TEST(RingMesh, RefusesToMergeAcrossASquare) {  // its diagonal is no boundary edge, its corners are all on the boundary
  const TriangleMesh square = testing::make_grid(1, 1);
  const RingMesh rings = rings_of(square);
  EXPECT_FALSE(rings.can_merge(0, 3));
  EXPECT_FALSE(rings.can_merge(3, 0));
  EXPECT_TRUE(rings.can_merge(0, 1));
}

TEST(RingMesh, RefusesToMergeWhatAreNoNeighbours) {
  const RingMesh rings = rings_of(test::make_octahedron());
  for (VertexId v = 0; v < 6; ++v) {
    EXPECT_FALSE(rings.can_merge(v, v));
    for (VertexId w = 0; w < 6; ++w) {
      if (rings.position_in_ring(v, w) == rings.ring_size(v)) {
        EXPECT_FALSE(rings.can_merge(v, w));
      }
    }
  }
}

TEST(RingMesh, ReusesTheRoomOfMergedRings) {
  RingMesh rings = rings_of(testing::make_sphere(20, 20));
  rings.split(3, 1000, 0, 2);
  rings.merge(3, 1000);
  const std::size_t bytes = rings.memory_bytes();
  for (int round = 0; round < 2000; ++round) {
    rings.split(3, 1000, 0, 2);
    rings.merge(3, 1000);
  }
  EXPECT_EQ(rings.memory_bytes(), bytes);
}

}  // namespace
}  // namespace fanstream
