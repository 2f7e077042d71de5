#include "client/collision/live_surface.h"

#include <gtest/gtest.h>

#include <glm/common.hpp>
#include <glm/vector_relational.hpp>
#include <set>

#include "tests/support/asset_helpers.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::SeededRandom;

Bounds box_of(const LiveTriangle& t) {
  Bounds box = kNoBounds;
  for (const glm::dvec3& p : t.corners) box = united(box, {p, p});
  return box;
}

bool overlap(const Bounds& a, const Bounds& b) {
  return glm::lessThanEqual(a.low, b.high) == glm::bvec3(true) && glm::lessThanEqual(b.low, a.high) == glm::bvec3(true);
}

// Goes through a node's leaves, and holds every box and count against what is below.
std::uint32_t check_node(const LiveSurface& surface, std::uint32_t n, std::set<std::uint32_t>& blocks) {
  const LiveSurface::Node& node = surface.node(n);
  std::uint32_t sum = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    sum += node.triangles[k];
    EXPECT_EQ(node.triangles[k] == 0, node.boxes.box(k).is_empty());
    if (node.triangles[k] == 0) continue;
    if ((node.below[k] & LiveSurface::Node::kLeaf) == 0) {
      EXPECT_EQ(check_node(surface, node.below[k], blocks), node.triangles[k]);
      EXPECT_EQ(surface.node(node.below[k]).boxes.sum(), node.boxes.box(k));
      continue;
    }
    EXPECT_NE(node.leaves() & (1U << k), 0U);
    const Bounds box = surface.frame().bounds(node.boxes.box(k));
    std::uint32_t triangles = 0;
    for (std::uint32_t b = node.below[k] & ~LiveSurface::Node::kLeaf; b != LiveSurface::Block::kNone;
         b = surface.block(b).next) {
      EXPECT_TRUE(blocks.insert(b).second) << "a block of two leaves";
      triangles += surface.block(b).count;
      for (std::size_t t = 0; t < surface.block(b).count; ++t) {
        const Bounds inner = box_of({surface.block(b).corners[t], {}, false});
        EXPECT_EQ(united(box, inner).low, box.low);
        EXPECT_EQ(united(box, inner).high, box.high);
      }
    }
    EXPECT_EQ(triangles, node.triangles[k]);
  }
  return sum;
}

TEST(LiveSurface, BoxesHoldWhatIsBelowWhereverTheMeshGoes) {
  for (const auto& [name, shape] : testing::model_shapes()) {
    SCOPED_TRACE(name);
    const testing::OpenAsset asset = testing::build_and_open(shape);
    ASSERT_TRUE(asset.head);
    ProgressiveMesh mesh(asset.head, MeshMemory::live_part);
    mesh.set_index(asset.index);
    mesh.set_all_targets(0);
    for (const auto& [cell, segment] : asset.segments()) {
      ASSERT_TRUE(mesh.add_segment(cell, segment, asset.segment(cell, segment)));
    }
    const CellHierarchy cells(*asset.head, *asset.index);
    LiveSurface surface(mesh, cells);
    const auto cell_count = static_cast<std::uint32_t>(asset.index->cells.size());
    SeededRandom random(9);
    std::uint32_t last_block = 0;
    for (int step = 0; step < 30; ++step) {
      SCOPED_TRACE("step " + std::to_string(step));
      std::vector<CellTarget> targets;
      const bool everything = step % 10 == 0;
      for (std::uint32_t c = 0; c < cell_count; ++c) {
        if (everything || random.one_in(4)) targets.push_back({c, everything ? 1000U : random.below(5)});
      }
      (void)mesh.move_to(targets);
      surface.update(mesh.take_changed_cells());
      std::set<std::uint32_t> blocks;
      EXPECT_EQ(check_node(surface, CellHierarchy::root(), blocks), surface.triangle_count());
      EXPECT_EQ(surface.triangle_count(), mesh.triangle_mesh().triangles.size());
      // Room is used again: no mesh takes more than the full one did, and a leaf's while it was being replaced.
      if (step == 0) last_block = *blocks.rbegin();
      EXPECT_LE(*blocks.rbegin(), 2 * last_block + 16);
    }
  }
}

TEST(LiveSurface, AVisitMissesNoTriangleThatReachesIntoTheBox) {
  const testing::OpenAsset asset = testing::build_and_open(testing::make_sphere(40, 60));
  ProgressiveMesh mesh(asset.head, MeshMemory::live_part);
  mesh.set_index(asset.index);
  for (const auto& [cell, segment] : asset.segments()) {
    ASSERT_TRUE(mesh.add_segment(cell, segment, asset.segment(cell, segment)));
  }
  (void)mesh.move_to({});
  const CellHierarchy cells(*asset.head, *asset.index);
  LiveSurface surface(mesh, cells);
  surface.update(mesh.take_changed_cells());
  SeededRandom random(3);
  std::size_t all_expected = 0;
  std::size_t all_visited = 0;
  for (int round = 0; round < 200; ++round) {
    const glm::dvec3 at = 2.0 * glm::dvec3(random.unit(), random.unit(), random.unit()) - 1.0;
    const Bounds wanted{at - 0.3 * random.unit(), at + 0.3 * random.unit()};
    std::set<std::array<VertexId, 3>> expected;
    std::set<std::array<VertexId, 3>> visited;
    surface.visit([](const Bounds&) { return true; },
                  [&](const LiveTriangle& t) {
                    if (overlap(box_of(t), wanted)) expected.insert(t.numbers);
                  });
    surface.visit([&](const Bounds& box) { return overlap(box, wanted); },
                  [&](const LiveTriangle& t) { visited.insert(t.numbers); });
    EXPECT_TRUE(std::includes(visited.begin(), visited.end(), expected.begin(), expected.end())) << "round " << round;
    all_expected += expected.size();
    all_visited += visited.size();
  }
  EXPECT_GT(all_expected, 100U);
  EXPECT_LT(all_visited, 10 * all_expected);
}

}  // namespace
}  // namespace fanstream
