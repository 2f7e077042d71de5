#include "server/build/merge_cost.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/mesh/manifold_check.h"
#include "server/build/simplifier.h"
#include "tests/support/asset_helpers.h"
#include "tests/support/every_cost.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/ring_views.h"

namespace fanstream {
namespace {

using testing::every_cost;
using testing::text_of;

// Meshes whose topology is sound and whose geometry is not.
std::vector<std::pair<std::string, TriangleMesh>> bad_meshes() {
  std::vector<std::pair<std::string, TriangleMesh>> all;
  all.emplace_back("flat sheet", testing::make_grid(14, 12));
  TriangleMesh line = testing::make_grid(10, 10);
  for (glm::dvec3& p : line.positions) p = {p.x, 0.0, 0.0};
  all.emplace_back("sheet on a line", line);
  TriangleMesh point = testing::make_torus(12, 10);
  for (glm::dvec3& p : point.positions) p = glm::dvec3(3.0, 4.0, 5.0);
  all.emplace_back("torus in a point", point);
  TriangleMesh pinched = testing::make_terrain(14, 14, 4);
  for (std::size_t v = 0; v + 1 < pinched.positions.size(); v += 3) pinched.positions[v] = pinched.positions[v + 1];
  all.emplace_back("coincident vertices", pinched);
  TriangleMesh needles = testing::make_sphere(12, 14);
  for (glm::dvec3& p : needles.positions) p.x *= 1e-12;
  all.emplace_back("sphere pressed flat", needles);
  TriangleMesh huge = testing::make_torus(12, 10);
  for (glm::dvec3& p : huge.positions) p *= 1e35;
  all.emplace_back("huge", huge);
  TriangleMesh tiny = testing::make_torus(12, 10);
  for (glm::dvec3& p : tiny.positions) p *= 1e-35;
  all.emplace_back("tiny", tiny);
  return all;
}

TEST(MergeCost, BadGeometryGivesFiniteCostsAndPlaces) {
  for (const auto& [name, mesh] : bad_meshes()) {
    const RingMesh rings = RingMesh::from_triangles(mesh.positions.size(), mesh.triangles);
    for (const CostOptions& options : every_cost()) {
      SCOPED_TRACE(name + ", " + text_of(options));
      const auto cost = make_merge_cost({mesh, rings, mesh.positions}, options, 0.5);
      for (VertexId v = 0; v < mesh.positions.size(); ++v) {
        for (const VertexId w : rings.ring(v)) {
          if (w == kOutside) continue;
          const MergeProposal proposal = cost->propose(v, w);
          ASSERT_TRUE(std::isfinite(proposal.cost) && proposal.cost >= 0.0) << v << " " << w << ": " << proposal.cost;
          if (proposal.parent != ParentPosition::free) continue;
          ASSERT_TRUE(std::isfinite(proposal.place.x + proposal.place.y + proposal.place.z)) << v << " " << w;
        }
      }
    }
  }
}

TEST(MergeCost, BadGeometryIsSimplifiedAllTheSame) {
  for (const auto& [name, mesh] : bad_meshes()) {
    for (const CostOptions& cost : every_cost()) {
      SCOPED_TRACE(name + ", " + text_of(cost));
      SimplifyOptions options;
      options.base_vertices = 40;
      options.cost = cost;
      const MergeHistory history = simplify(mesh, options);
      std::string why;
      EXPECT_TRUE(is_oriented_manifold(testing::compact_faces(history.base), &why)) << why;
      for (const glm::dvec3& place : history.free_places) EXPECT_TRUE(std::isfinite(place.x + place.y + place.z));
    }
  }
}

TEST(MergeCost, TheSameMeshGivesTheSameMerges) {
  const TriangleMesh mesh = testing::make_terrain(24, 20, 8);
  for (const CostOptions& cost : every_cost()) {
    SCOPED_TRACE(text_of(cost));
    SimplifyOptions options;
    options.base_vertices = 60;
    options.cost = cost;
    const MergeHistory a = simplify(mesh, options);
    const MergeHistory b = simplify(mesh, options);
    EXPECT_EQ(a.base_vertices, 60U);
    ASSERT_EQ(a.merges.size(), b.merges.size());
    for (std::size_t m = 0; m < a.merges.size(); ++m) {
      ASSERT_EQ(a.merges[m].root, b.merges[m].root);
      ASSERT_EQ(a.merges[m].removed, b.merges[m].removed);
      ASSERT_EQ(a.merges[m].parent, b.merges[m].parent);
      ASSERT_EQ(a.merges[m].cost, b.merges[m].cost);
    }
    EXPECT_EQ(a.free_places, b.free_places);
  }
}

TEST(MergeCost, PlacementsPutParentsWhereTheySay) {
  const TriangleMesh mesh = testing::make_terrain(24, 20, 8);
  for (const CostOptions& cost : every_cost()) {
    SCOPED_TRACE(text_of(cost));
    SimplifyOptions options;
    options.base_vertices = 60;
    options.cost = cost;
    const MergeHistory history = simplify(mesh, options);
    std::vector<glm::dvec3> places = mesh.positions;
    std::size_t free_parents = 0;
    for (std::size_t m = 0; m < history.merges.size(); ++m) {
      const MergeRecord& merge = history.merges[m];
      const glm::dvec3 a = places[merge.root];
      const glm::dvec3 b = places[merge.removed];
      glm::dvec3& place = places[merge.root];
      if (merge.parent == ParentPosition::added) place = b;
      if (merge.parent == ParentPosition::middle) {
        ASSERT_EQ(cost.placement, Placement::ends_middle);
        place = 0.5 * (a + b);
      }
      if (merge.parent != ParentPosition::free) continue;
      ASSERT_TRUE(cost.placement == Placement::segment || cost.placement == Placement::optimal);
      ++free_parents;
      place = history.free_places[m];
      if (cost.placement != Placement::segment) continue;
      const glm::dvec3 u = b - a;
      const double k = (place.x - a.x) * u.x + (place.y - a.y) * u.y + (place.z - a.z) * u.z;
      const double length2 = u.x * u.x + u.y * u.y + u.z * u.z;
      ASSERT_GE(k, -1e-9 * length2);
      ASSERT_LE(k, (1.0 + 1e-9) * length2);
    }
    const bool may_be_free = cost.placement == Placement::segment || cost.placement == Placement::optimal;
    EXPECT_EQ(free_parents > 0, may_be_free);
  }
}

// On a cylinder, curvature tells round from flat: along the axis nothing bends.
TEST(MergeCost, CurvatureMakesMergesDearer) {
  const TriangleMesh mesh = testing::make_sphere(20, 24);
  const RingMesh rings = RingMesh::from_triangles(mesh.positions.size(), mesh.triangles);
  const MeshView view{mesh, rings, mesh.positions};
  const auto flat = make_merge_cost(view, {.cost = CostKind::quadric}, 0.0);
  const auto curved = make_merge_cost(view, {.cost = CostKind::curvature}, 0.0);
  std::size_t differs = 0;
  for (VertexId v = 0; v < mesh.positions.size(); ++v) {
    for (const VertexId w : rings.ring(v)) differs += flat->propose(v, w).cost != curved->propose(v, w).cost ? 1 : 0;
  }
  EXPECT_GT(differs, mesh.positions.size());
  const TriangleMesh sheet = testing::make_grid(8, 8);
  const RingMesh sheet_rings = RingMesh::from_triangles(sheet.positions.size(), sheet.triangles);
  const MeshView sheet_view{sheet, sheet_rings, sheet.positions};
  const auto flat_sheet = make_merge_cost(sheet_view, {.cost = CostKind::quadric}, 0.0);
  const auto curved_sheet = make_merge_cost(sheet_view, {.cost = CostKind::curvature}, 0.0);
  for (VertexId v = 0; v < sheet.positions.size(); ++v) {
    for (const VertexId w : sheet_rings.ring(v)) {
      if (w == kOutside) continue;
      EXPECT_NEAR(flat_sheet->propose(v, w).cost, curved_sheet->propose(v, w).cost, 1e-12);
    }
  }
}

// The paper's energy, from its definition: what a merge proposes is what E grows by, in the order of E.
TEST(MergeCost, FansOrdersMergesByTheGrowthOfTheEnergy) {
  const TriangleMesh mesh = testing::make_terrain(8, 7, 2);
  const RingMesh rings = RingMesh::from_triangles(mesh.positions.size(), mesh.triangles);
  const double kappa = 0.01;
  const auto cost = make_merge_cost({mesh, rings, mesh.positions},
                                    {.cost = CostKind::fans, .placement = Placement::end, .kappa = kappa}, 0.0);
  const auto energy = [&](const TriangleMesh& level) { return testing::fans_energy(mesh.positions, level, kappa); };
  const double before = energy(mesh);
  std::vector<std::pair<double, double>> by_cost;  // cost, growth
  for (VertexId v = 0; v < mesh.positions.size(); ++v) {
    for (const VertexId w : rings.ring(v)) {
      if (w == kOutside || w < v || !rings.can_merge(v, w)) continue;
      const MergeProposal proposal = cost->propose(v, w);
      RingMesh merged = rings;
      merged.merge(v, w);
      TriangleMesh level{mesh.positions, merged.triangles()};
      if (proposal.parent == ParentPosition::added) level.positions[v] = mesh.positions[w];
      by_cost.emplace_back(proposal.cost, energy(level) - before);
    }
  }
  std::sort(by_cost.begin(), by_cost.end());
  // A point may be nearer to a face farther away than those it is handed to: the true energy is never more.
  std::size_t in_order = 0;
  for (std::size_t i = 1; i < by_cost.size(); ++i)
    in_order += by_cost[i - 1].second <= by_cost[i].second + 1e-9 ? 1 : 0;
  EXPECT_GE(in_order, by_cost.size() * 95 / 100);
}

}  // namespace
}  // namespace fanstream
