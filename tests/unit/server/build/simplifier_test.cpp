#include "server/build/simplifier.h"

#include <gtest/gtest.h>

#include "common/coding/fan_vertex.h"
#include "common/mesh/manifold_check.h"
#include "server/build/surface_error.h"
#include "tests/support/asset_helpers.h"
#include "tests/support/merge_history_checks.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/ring_views.h"

namespace fanstream {
namespace {

using testing::compact_faces;

SimplifyOptions down_to(std::uint32_t vertices, double distance_growth = 0.0) {
  SimplifyOptions options;
  options.base_vertices = vertices;
  options.distance_growth = distance_growth;
  return options;
}

// Without a limit, with a usual one, and with one that hardly anything comes within.
constexpr double kDistanceGrowths[] = {0.0, 1.27, 0.02};

TEST(Simplifier, PatchesOfOneGenerationShareNoFace) {
  for (const auto& [name, mesh] : testing::model_shapes()) {
    for (const double growth : kDistanceGrowths) {
      SCOPED_TRACE(name + ", distances may grow by " + std::to_string(growth));
      testing::expect_disjoint_patches(mesh, simplify(mesh, down_to(60, growth)));
      if (HasFatalFailure()) return;
    }
  }
}

TEST(Simplifier, EveryGenerationLeavesAManifold) {
  for (const auto& [name, mesh] : testing::model_shapes()) {
    SCOPED_TRACE(name);
    const MergeHistory history = simplify(mesh, down_to(60));
    RingMesh rings = RingMesh::from_triangles(mesh.positions.size(), mesh.triangles);
    for (std::uint32_t g = 0; g < history.generation_count(); ++g) {
      for (std::uint32_t m = history.generation_begin[g]; m < history.generation_begin[g + 1]; ++m) {
        rings.merge(history.merges[m].root, history.merges[m].removed);
      }
      std::string why;
      ASSERT_TRUE(is_oriented_manifold(compact_faces(rings), &why)) << "generation " << g << ": " << why;
    }
    EXPECT_EQ(compact_faces(history.base).positions.size(), history.base_vertices);
  }
}

TEST(Simplifier, CleanModelsReachTheirTarget) {
  const std::vector<std::pair<std::string, TriangleMesh>> models = {{"sphere", testing::make_sphere(40, 50)},
                                                                    {"torus", testing::make_torus(50, 30)},
                                                                    {"terrain", testing::make_terrain(50, 40, 2)},
                                                                    {"cylinder", testing::make_open_cylinder(40, 40)},
                                                                    {"flat grid", testing::make_grid(40, 40)}};
  for (const auto& [name, mesh] : models) {
    for (const std::uint32_t target : {600U, 100U, 64U}) {
      for (const double growth : kDistanceGrowths) {
        SCOPED_TRACE(name + " to " + std::to_string(target) + ", distances may grow by " + std::to_string(growth));
        const MergeHistory history = simplify(mesh, down_to(target, growth));
        EXPECT_EQ(history.base_vertices, target);
        EXPECT_EQ(history.merges.size(), mesh.positions.size() - target);
        EXPECT_EQ(history.generation_begin.front(), 0U);
        EXPECT_EQ(history.generation_begin.back(), history.merges.size());
        EXPECT_LE(history.generation_count(), kMostGenerations);
      }
    }
  }
}

TEST(Simplifier, TheSameMeshGivesTheSameMerges) {
  const TriangleMesh mesh = testing::make_terrain(40, 40, 8);
  const MergeHistory a = simplify(mesh, down_to(80));
  const MergeHistory b = simplify(mesh, down_to(80));
  ASSERT_EQ(a.merges.size(), b.merges.size());
  EXPECT_EQ(a.generation_begin, b.generation_begin);
  for (std::size_t m = 0; m < a.merges.size(); ++m) {
    ASSERT_EQ(a.merges[m].root, b.merges[m].root);
    ASSERT_EQ(a.merges[m].removed, b.merges[m].removed);
    ASSERT_EQ(a.merges[m].parent, b.merges[m].parent);
  }
}

TEST(Simplifier, RingsStayShort) {
  SimplifyOptions options = down_to(64);
  options.longest_ring = 9;
  const TriangleMesh mesh = testing::make_torus(40, 30);
  const MergeHistory history = simplify(mesh, options);
  RingMesh rings = RingMesh::from_triangles(mesh.positions.size(), mesh.triangles);
  for (const MergeRecord& merge : history.merges) {
    rings.merge(merge.root, merge.removed);
    ASSERT_LE(rings.ring_size(merge.root), 9U);
  }
}

TEST(Simplifier, AMeshAtItsTargetIsLeftAlone) {
  const TriangleMesh mesh = testing::make_sphere(5, 6);
  const MergeHistory history = simplify(mesh, down_to(1000));
  EXPECT_TRUE(history.merges.empty());
  EXPECT_EQ(history.generation_count(), 0U);
  EXPECT_EQ(history.base_vertices, mesh.positions.size());
}

// However few merges a generation makes: the last sixteen take all that they can get.
TEST(Simplifier, NoMoreGenerationsThanTheFormatAllows) {
  SimplifyOptions options = down_to(40);
  options.edges_per_vertex = 0.12;
  const MergeHistory history = simplify(testing::make_torus(160, 120), options);
  EXPECT_LE(history.generation_count(), kMostGenerations);
  EXPECT_GT(history.generation_count(), kMostGenerations - 16);
  EXPECT_EQ(history.base_vertices, 40U);
}

// Down to a third of the vertices, certified: of the merges that are left out.
TEST(Simplifier, LimitedDistancesMakeTheLargestErrorSmaller) {
  double with = 0.0;
  double without = 0.0;
  for (const std::uint64_t seed : {1, 2, 3}) {
    const TriangleMesh mesh = testing::make_terrain(90, 80, seed);
    const PositionGrid grid = PositionGrid::fit(mesh.positions, 14);
    std::vector<GridPoint> places;
    for (const glm::dvec3& p : mesh.positions) places.push_back(grid.encode(p));
    const auto largest = [&](double growth) {
      const MergeHistory history = simplify(mesh, down_to(2400, growth));
      const CodedHistory coded(history, places, grid);
      const PlacedMesh placed(mesh.triangles, places, grid);
      float error = 0.0F;
      for (const PatchSurface& patch : measure_surface(placed, coded).patches) {
        error = std::max(error, patch.error);
      }
      return static_cast<double>(error);
    };
    with += largest(1.27);
    without += largest(0.0);
  }
  EXPECT_LT(with, 0.9 * without);
}

TEST(Simplifier, MergesOfCoarserGenerationsCostMore) {
  const MergeHistory history = simplify(testing::make_sphere(60, 60), down_to(64));
  const auto mean = [&](std::uint32_t g) {
    double sum = 0.0;
    for (std::uint32_t m = history.generation_begin[g]; m < history.generation_begin[g + 1]; ++m) {
      sum += static_cast<double>(history.merges[m].cost);
    }
    return sum / (history.generation_begin[g + 1] - history.generation_begin[g]);
  };
  ASSERT_GE(history.generation_count(), 4U);
  EXPECT_GT(mean(history.generation_count() - 1), 4.0 * mean(0));
}

}  // namespace
}  // namespace fanstream
