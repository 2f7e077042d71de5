#include "server/build/distance_limit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <set>
#include <utility>

#include "common/fans/ring_mesh.h"
#include "common/geometry/closest_point.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

struct Edge {
  VertexId root = 0;
  VertexId removed = 0;
};

bool has(const Triangle& t, VertexId v) { return t[0] == v || t[1] == v || t[2] == v; }

// Of a mesh that nothing has been merged in yet: how far points are off once the edge is merged, looked at one by one.
double reached_by(const TriangleMesh& mesh, const Edge& edge) {
  const std::vector<glm::dvec3>& at = mesh.positions;
  std::vector<glm::dvec3> points;
  std::vector<std::array<glm::dvec3, 3>> rest;
  std::vector<bool> is_placed(at.size(), false);
  std::set<std::pair<VertexId, VertexId>> edges;  // as they go around faces
  for (const Triangle& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) edges.emplace(t[i], t[(i + 1) % 3]);
  }
  for (const Triangle& t : mesh.triangles) {
    const bool around = has(t, edge.root) || has(t, edge.removed);
    for (int i = 0; i < 3; ++i) {
      if (around && !is_placed[t[i]]) points.push_back(at[t[i]]);
      is_placed[t[i]] = true;
      const VertexId next = t[(i + 1) % 3];
      const bool is_second = t[i] > next && edges.contains({next, t[i]});
      if (around && !is_second) points.push_back(0.5 * (at[t[i]] + at[next]));
    }
    if (!around || (has(t, edge.root) && has(t, edge.removed))) continue;
    std::array<glm::dvec3, 3> face;
    for (int i = 0; i < 3; ++i) face[i] = at[t[i] == edge.removed ? edge.root : t[i]];
    rest.push_back(face);
  }
  double farthest = 0.0;
  for (const glm::dvec3& p : points) {
    double nearest = INFINITY;
    for (const auto& f : rest) {
      nearest = std::min(nearest, glm::distance(p, closest_point_on_triangle(p, f[0], f[1], f[2])));
    }
    farthest = std::max(farthest, nearest);
  }
  return farthest;
}

// Edges that can be merged, no two of which have a face in common.
std::vector<Edge> scattered_edges(const TriangleMesh& mesh, testing::SeededRandom& random) {
  RingMesh rings = RingMesh::from_triangles(mesh.positions.size(), mesh.triangles);
  std::vector<Edge> edges;
  std::set<VertexId> taken;
  for (int attempt = 0; attempt < 4000; ++attempt) {
    const auto root = static_cast<VertexId>(random.below(static_cast<std::uint32_t>(mesh.positions.size())));
    const auto ring = rings.ring(root);
    const VertexId removed = ring[random.below(static_cast<std::uint32_t>(ring.size()))];
    if (removed == kOutside || !rings.can_merge(root, removed)) continue;
    std::set<VertexId> near{root, removed};
    for (const VertexId end : {root, removed}) near.insert(rings.ring(end).begin(), rings.ring(end).end());
    if (std::any_of(near.begin(), near.end(), [&](VertexId v) { return taken.contains(v); })) continue;
    near.erase(kOutside);
    taken.insert(near.begin(), near.end());
    edges.push_back({root, removed});
  }
  return edges;
}

TEST(DistanceLimit, IsThatShareOfWhatTheLastGenerationHasLeft) {
  constexpr double kGrowth = 0.7;
  std::size_t allowed = 0;
  std::size_t refused = 0;
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    testing::SeededRandom random(seed);
    const TriangleMesh mesh =
        random.one_in(2) ? testing::make_terrain(60, 50, seed) : testing::make_torus(70, 40, 1.0, 0.4);
    const std::vector<Edge> edges = scattered_edges(mesh, random);
    ASSERT_GT(edges.size(), 60U);
    DistanceLimit limit(mesh, kGrowth);
    const auto vertices = static_cast<std::uint32_t>(mesh.positions.size());
    limit.begin_generation(vertices, false);
    EXPECT_FALSE(limit.is_limited());
    std::vector<double> reached;
    for (std::size_t i = 0; i < edges.size() / 2; ++i) {
      ASSERT_TRUE(limit.allows(edges[i].root, edges[i].removed, mesh.positions[edges[i].root]));
      limit.merge(edges[i].root, edges[i].removed);
      reached.push_back(reached_by(mesh, edges[i]));
    }
    std::sort(reached.begin(), reached.end());
    const double most =
        kGrowth * reached[static_cast<std::size_t>(DistanceLimit::kShare * static_cast<double>(reached.size() - 1))];
    limit.begin_generation(vertices, true);
    ASSERT_TRUE(limit.is_limited());
    for (std::size_t i = edges.size() / 2; i < edges.size(); ++i) {
      const double distance = reached_by(mesh, edges[i]);
      if (std::fabs(distance - most) < 1e-4 * most) continue;  // single precision
      const bool is_allowed = limit.allows(edges[i].root, edges[i].removed, mesh.positions[edges[i].root]);
      EXPECT_EQ(is_allowed, distance < most) << "edge " << i;
      ++(is_allowed ? allowed : refused);
    }
    limit.begin_generation(vertices, false);
    EXPECT_TRUE(limit.allows(edges.back().root, edges.back().removed, mesh.positions[edges.back().root]));
  }
  EXPECT_GT(allowed, 20U);
  EXPECT_GT(refused, 20U);
}

TEST(DistanceLimit, OfAGenerationThatBeginsWithoutOneFollowsFromItsFirstMerges) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    testing::SeededRandom random(seed);
    const TriangleMesh mesh = testing::make_terrain(60, 50, seed);
    const std::vector<Edge> edges = scattered_edges(mesh, random);
    constexpr std::size_t kFirst = 20;
    ASSERT_GT(edges.size(), 2 * kFirst);
    DistanceLimit limit(mesh, 1.3);
    limit.begin_generation(static_cast<std::uint32_t>(std::ceil(kFirst / DistanceLimit::kTrialShare)), false);
    std::vector<double> reached;
    for (std::size_t i = 0; i < kFirst; ++i) {
      EXPECT_FALSE(limit.is_limited()) << i;
      ASSERT_TRUE(limit.allows(edges[i].root, edges[i].removed, mesh.positions[edges[i].root]));
      limit.merge(edges[i].root, edges[i].removed);
      reached.push_back(reached_by(mesh, edges[i]));
    }
    ASSERT_TRUE(limit.is_limited());
    std::sort(reached.begin(), reached.end());
    const double most = DistanceLimit::kTrialGrowth *
                        reached[static_cast<std::size_t>(DistanceLimit::kShare * static_cast<double>(kFirst - 1))];
    for (std::size_t i = kFirst; i < edges.size(); ++i) {
      const double distance = reached_by(mesh, edges[i]);
      if (std::fabs(distance - most) < 1e-4 * most) continue;  // single precision
      EXPECT_EQ(limit.allows(edges[i].root, edges[i].removed, mesh.positions[edges[i].root]), distance < most) << i;
    }
  }
}

// What is flat but for a few edges: these wait until there is nothing else.
TEST(DistanceLimit, MergesThatCostNothingGoBeforeOthersAtOnce) {
  TriangleMesh mesh = testing::make_grid(20, 20);
  const auto at = [](VertexId x, VertexId y) { return 21 * y + x; };
  for (VertexId y = 0; y <= 20; ++y) mesh.positions[at(10, y)].z = 5.0;  // a roof
  DistanceLimit limit(mesh, 1.6);
  const auto allows = [&](VertexId root, VertexId removed) {
    return limit.allows(root, removed, mesh.positions[root]);
  };
  limit.begin_generation(40, false);
  for (const VertexId x : {2U, 6U}) {
    ASSERT_TRUE(allows(at(x, 4), at(x + 1, 4)));
    limit.merge(at(x, 4), at(x + 1, 4));
  }
  ASSERT_TRUE(limit.is_limited());
  EXPECT_FALSE(allows(at(9, 14), at(10, 14))) << "the ridge would sink";
  EXPECT_TRUE(allows(at(10, 15), at(10, 14))) << "along the ridge";
  EXPECT_TRUE(allows(at(14, 14), at(15, 14)));
}

// A point that one generation has left far off is far off for the next one too, whatever that does around it.
TEST(DistanceLimit, RemembersWhatEarlierGenerationsHaveLeft) {
  TriangleMesh mesh = testing::make_grid(12, 12);
  const auto at = [](VertexId x, VertexId y) { return 13 * y + x; };
  mesh.positions[at(3, 3)].z = 1.0;
  DistanceLimit limit(mesh, 0.5);
  const auto allows = [&](VertexId root, VertexId removed) {
    return limit.allows(root, removed, mesh.positions[root]);
  };
  limit.begin_generation(169, false);
  ASSERT_TRUE(allows(at(4, 3), at(3, 3)));
  limit.merge(at(4, 3), at(3, 3));
  limit.begin_generation(168, true);
  EXPECT_FALSE(allows(at(4, 3), at(4, 2))) << "the faces around still have the peak";
  EXPECT_TRUE(allows(at(9, 9), at(10, 9))) << "all is flat";
  limit.merge(at(9, 9), at(10, 9));
}

TEST(DistanceLimit, PointsInOnePlaceAndHugeOnesDoNoHarm) {
  for (const double scale : {0.0, 1e-40, 1e40, 1e300}) {
    SCOPED_TRACE("scale " + std::to_string(scale));
    TriangleMesh mesh = testing::make_torus(12, 9);
    for (glm::dvec3& p : mesh.positions) p *= scale;
    testing::SeededRandom random(1);
    DistanceLimit limit(mesh, 1.27);
    for (const bool limited : {false, true}) {
      limit.begin_generation(static_cast<std::uint32_t>(mesh.positions.size()), limited);
      for (const Edge& edge : scattered_edges(mesh, random)) {
        limit.allows(edge.root, edge.removed, mesh.positions[edge.root]);
        if (!limited) limit.merge(edge.root, edge.removed);
      }
    }
  }
}

}  // namespace
}  // namespace fanstream
