#include "server/build/error_levels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "common/coding/fan_vertex.h"
#include "server/build/surface_error.h"
#include "tests/support/asset_helpers.h"
#include "tests/support/merge_history_checks.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

struct Ordered {
  TriangleMesh mesh;
  PositionGrid grid;
  std::vector<GridPoint> codes;
  MergeHistory before;
  MergeHistory after;

  Ordered(const TriangleMesh& model, const LevelOptions& options, const CostOptions& cost = {},
          std::uint32_t faces_of_part = PlacedMesh::kFacesOfPart)
      : mesh(model), grid(PositionGrid::fit(model.positions, 12)) {
    for (const glm::dvec3& p : mesh.positions) codes.push_back(grid.encode(p));
    SimplifyOptions simplify_options;
    simplify_options.base_vertices = 60;
    simplify_options.cost = cost;
    simplify_options.edges_per_vertex = 2.5;
    before = simplify(mesh, simplify_options);
    const CodedHistory coded(before, codes, grid);
    after = level_by_error(PlacedMesh(mesh.triangles, codes, grid, faces_of_part), coded, options);
  }
};

using Merge = std::tuple<VertexId, VertexId, VertexId, VertexId, ParentPosition>;
std::vector<Merge> sorted(const MergeHistory& history) {
  std::vector<Merge> merges;
  for (const MergeRecord& m : history.merges) merges.emplace_back(m.root, m.removed, m.first, m.last, m.parent);
  std::sort(merges.begin(), merges.end());
  return merges;
}

const LevelOptions kOptions[] = {{0.95, 1.7}, {0.5, 1.3}, {0.0, 1.2}, {1.0, 1.7}};

TEST(ErrorLevels, TheSameMergesGoInGenerationsWhosePatchesShareNoFace) {
  for (const auto& [name, mesh] : testing::model_shapes()) {
    for (const LevelOptions& options : kOptions) {
      SCOPED_TRACE(name + ", fine share " + std::to_string(options.fine_share));
      const Ordered ordered(mesh, options);
      const MergeHistory& history = ordered.after;
      ASSERT_EQ(sorted(history), sorted(ordered.before));
      ASSERT_EQ(history.base_vertices, ordered.before.base_vertices);
      for (std::uint32_t g = 0; g < history.generation_count(); ++g) {
        ASSERT_LT(history.generation_begin[g], history.generation_begin[g + 1]) << "an empty generation";
      }
      testing::expect_disjoint_patches(mesh, history);
      if (HasFatalFailure()) return;
      EXPECT_EQ(history.generation_begin.back(), history.merges.size());
      EXPECT_LE(history.generation_count(), kMostGenerations);
    }
  }
}

TEST(ErrorLevels, AModelInPartsGetsTheSameGenerations) {
  for (const auto& [name, mesh] : testing::model_shapes()) {
    SCOPED_TRACE(name);
    const Ordered whole(mesh, {0.7, 1.4});
    const Ordered in_parts(mesh, {0.7, 1.4}, {}, 100);
    EXPECT_EQ(in_parts.after.generation_begin, whole.after.generation_begin);
    for (std::size_t m = 0; m < whole.after.merges.size(); ++m) {
      ASSERT_EQ(in_parts.after.merges[m].root, whole.after.merges[m].root);
      ASSERT_EQ(in_parts.after.merges[m].removed, whole.after.merges[m].removed);
    }
  }
}

TEST(ErrorLevels, FreePlacesStayWithTheirMerges) {
  CostOptions cost;
  cost.placement = Placement::optimal;
  const Ordered ordered(testing::make_terrain(60, 50, 4), {0.7, 1.4}, cost);
  ASSERT_FALSE(ordered.before.free_places.empty());
  std::map<std::pair<VertexId, VertexId>, glm::dvec3> places;
  for (std::size_t m = 0; m < ordered.before.merges.size(); ++m)
    places[{ordered.before.merges[m].root, ordered.before.merges[m].removed}] = ordered.before.free_places[m];
  ASSERT_EQ(ordered.after.free_places.size(), ordered.after.merges.size());
  for (std::size_t m = 0; m < ordered.after.merges.size(); ++m) {
    const MergeRecord& merge = ordered.after.merges[m];
    ASSERT_EQ(ordered.after.free_places[m], (places[{merge.root, merge.removed}]));
  }
}

// Splits that a uniform mesh needs until no patch that is merged is further off.
std::size_t splits_to(const Ordered& ordered, const MergeHistory& history, double error) {
  const CodedHistory coded(history, ordered.codes, ordered.grid);
  const PlacedMesh placed(ordered.mesh.triangles, ordered.codes, ordered.grid);
  const SurfaceErrors errors = measure_surface(placed, coded);
  std::uint32_t g = 0;
  const auto good = [&] {
    for (std::uint32_t m = history.generation_begin[g]; m < history.generation_begin[g + 1]; ++m) {
      if (errors.patches[errors.patch_of[m]].error > error) return false;
    }
    return true;
  };
  while (g < history.generation_count() && good()) ++g;
  return history.merges.size() - history.generation_begin[g];
}

// Wide waves, and short ones on a sixteenth of them: the worst of each generation are there.
TriangleMesh waves_of_two_kinds() {
  TriangleMesh mesh = testing::make_grid(120, 120);
  const Bounds box = bounds_of(mesh.positions);
  const glm::dvec3 size = box.high - box.low;
  const int up = size.x < size.y ? (size.x < size.z ? 0 : 2) : (size.y < size.z ? 1 : 2);
  for (glm::dvec3& p : mesh.positions) {
    const double u = (p - box.low)[(up + 1) % 3] / size[(up + 1) % 3];
    const double v = (p - box.low)[(up + 2) % 3] / size[(up + 2) % 3];
    const auto wave = [&](double times) { return std::sin(times * u) * std::sin(times * v + 1.0); };
    p[up] += box.diagonal() * (0.04 * wave(12.0) + (u < 0.25 && v < 0.25 ? 0.006 * wave(100.0) : 0.0));
  }
  return mesh;
}

TEST(ErrorLevels, AnErrorTakesFewerSplits) {
  const Ordered ordered(waves_of_two_kinds(), {0.8, 1.4});
  const double diagonal = bounds_of(ordered.mesh.positions).diagonal();
  for (const double share : {0.002, 0.004}) {
    const std::size_t before = splits_to(ordered, ordered.before, share * diagonal);
    const std::size_t after = splits_to(ordered, ordered.after, share * diagonal);
    EXPECT_LT(static_cast<double>(after), 0.8 * static_cast<double>(before)) << "error " << share;
  }
}

TEST(ErrorLevels, AHistoryWithoutMergesStaysSo) {
  const TriangleMesh mesh = testing::make_grid(3, 3);
  const Ordered ordered(mesh, {});
  EXPECT_TRUE(ordered.after.merges.empty());
  EXPECT_EQ(ordered.after.generation_count(), 0U);
}

}  // namespace
}  // namespace fanstream
