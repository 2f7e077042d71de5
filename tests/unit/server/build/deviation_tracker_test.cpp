#include "server/build/deviation_tracker.h"

#include <gtest/gtest.h>

#include "server/build/merged_ring.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

TriangleMesh bumpy() { return testing::make_terrain(120, 120, 3); }

// Merges of that mesh in random order, told to a tracker.
std::vector<float> track(DeviationTracker& tracker, std::vector<std::pair<VertexId, VertexId>>* merges = nullptr) {
  TriangleMesh mesh = bumpy();
  RingMesh rings = RingMesh::from_triangles(mesh.positions.size(), mesh.triangles);
  testing::SeededRandom random(5);
  MergedRing ring;
  for (int i = 0; i < 30'000; ++i) {
    const VertexId root = random.below(static_cast<std::uint32_t>(mesh.positions.size()));
    if (!rings.contains(root)) continue;
    const VertexId removed = rings.ring(root)[random.below(rings.ring_size(root))];
    if (removed == kOutside || !rings.can_merge(root, removed)) continue;
    ring.assign(rings, root, removed);
    ring.assign_places(mesh.positions);
    const glm::dvec3 target = i % 3 == 0 ? 0.5 * (mesh.positions[root] + mesh.positions[removed])
                                         : mesh.positions[i % 3 == 1 ? root : removed];
    tracker.add(root, removed, ring.ids(),
                {ring.places(), ring.gap(), ring.arc(), mesh.positions[root], mesh.positions[removed], target});
    rings.merge(root, removed);
    mesh.positions[root] = target;
    if (merges != nullptr) merges->push_back({root, removed});
  }
  return tracker.finish();
}

TEST(DeviationTracker, AThreadOfItsOwnGivesTheSameBounds) {
  DeviationTracker alone(bumpy().positions, false);
  DeviationTracker helped(bumpy().positions, true);
  const std::vector<float> expected = track(alone);
  EXPECT_GT(expected.size(), 5000U);
  EXPECT_EQ(track(helped), expected);
}

TEST(DeviationTracker, BoundsNeverShrink) {
  DeviationTracker tracker(bumpy().positions, false);
  std::vector<std::pair<VertexId, VertexId>> merges;
  const std::vector<float> bounds = track(tracker, &merges);
  ASSERT_EQ(bounds.size(), merges.size());
  std::vector<float> by_vertex(bumpy().positions.size(), 0.0F);
  for (std::size_t m = 0; m < merges.size(); ++m) {
    const auto [root, removed] = merges[m];
    ASSERT_GE(bounds[m], std::max(by_vertex[root], by_vertex[removed])) << "merge " << m;
    by_vertex[root] = bounds[m];
  }
}

TEST(DeviationTracker, MayBeLeftUnfinished) {
  DeviationTracker tracker(std::vector<glm::dvec3>(10), true);
  const std::vector<VertexId> ids{1, 2, 3, 4};
  const std::vector<glm::dvec3> places{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  tracker.add(0, 5, ids, {places, 4, 2, {0.4, 0.5, 0}, {0.6, 0.5, 0}, {0.4, 0.5, 0}});
}

}  // namespace
}  // namespace fanstream
