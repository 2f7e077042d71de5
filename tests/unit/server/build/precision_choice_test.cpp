#include "server/build/precision_choice.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/geometry/mesh_distance.h"
#include "tests/support/asset_helpers.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

SimplifyOptions down_to(std::uint32_t vertices) {
  SimplifyOptions options;
  options.base_vertices = vertices;
  return options;
}

TEST(PrecisionChoice, LevelsAreMeasuredFineToCoarse) {
  const TriangleMesh mesh = testing::make_torus(90, 60);
  const MergeHistory history = simplify(mesh, down_to(60));
  const std::vector<LevelDistance> levels = measure_level_distances(mesh, history);
  ASSERT_GE(levels.size(), 4U);
  EXPECT_LE(levels.front().vertices, mesh.positions.size() / 4);
  EXPECT_EQ(levels.back().vertices, history.base_vertices);
  for (std::size_t i = 1; i < levels.size(); ++i) {
    EXPECT_LT(levels[i].vertices, levels[i - 1].vertices);
    EXPECT_GT(levels[i].rms, levels[i - 1].rms);
  }
  // The coarsest is FM0: its distance, sampled another way, over the area.
  TriangleMesh base;
  base.positions = mesh.positions;
  for (std::size_t m = 0; m < history.merges.size(); ++m) {
    const MergeRecord& merge = history.merges[m];
    if (merge.parent == ParentPosition::added) base.positions[merge.root] = base.positions[merge.removed];
    if (merge.parent == ParentPosition::middle) {
      base.positions[merge.root] = 0.5 * (base.positions[merge.root] + base.positions[merge.removed]);
    }
  }
  base.triangles = history.base.triangles();
  const auto tree = TriangleTree::build(base);
  ASSERT_TRUE(tree);
  const auto distance = directed_distance(mesh, *tree);
  ASSERT_TRUE(distance);
  EXPECT_NEAR(levels.back().rms, distance->rms, 0.15 * distance->rms);
}

TEST(PrecisionChoice, CellsAreAsCoarseAsTheNoiseAllows) {
  const TriangleMesh mesh = testing::make_torus(90, 60);
  const MergeHistory history = simplify(mesh, down_to(60));
  const PositionGrid grid = PositionGrid::fit(mesh.positions, 12);
  const double off = measure_level_distances(mesh, history).back().rms / grid.step();  // of FM0
  for (const double noise : {0.01, 0.05, 0.15, 0.5}) {
    const PlacePrecision precision = choose_precision(mesh, history, grid, noise);
    const auto mean_square = [](std::uint32_t bits) {
      double sum = 0.0;
      const int codes = 1 << bits;
      for (int i = 0; i < codes; ++i) sum += (i - codes / 2) * (i - codes / 2);
      return sum / codes;
    };
    EXPECT_LE(mean_square(precision.left_out(0)), noise * off * off) << noise;
    EXPECT_GT(mean_square(precision.left_out(0) + 1), noise * off * off) << noise;
    for (std::uint32_t g = 1; g <= history.generation_count(); ++g) {
      EXPECT_LE(precision.left_out(g), precision.left_out(g - 1));
    }
    EXPECT_EQ(precision.left_out(history.generation_count()), 0U);
  }
  EXPECT_TRUE(choose_precision(mesh, history, grid, 0.0).is_exact());
}

// There is nothing to hide noise in.
TEST(PrecisionChoice, AFlatModelStaysExact) {
  TriangleMesh mesh = testing::make_terrain(40, 40, 1);
  for (glm::dvec3& p : mesh.positions) p.z = 0.25 * p.x;
  const MergeHistory history = simplify(mesh, down_to(60));
  ASSERT_GT(history.generation_count(), 2U);
  EXPECT_TRUE(choose_precision(mesh, history, PositionGrid::fit(mesh.positions, 12), 0.15).is_exact());
}

}  // namespace
}  // namespace fanstream
