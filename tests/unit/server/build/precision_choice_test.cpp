#include "server/build/precision_choice.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/common.hpp>

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
  EXPECT_LE(levels.front().vertices, mesh.positions.size() / 2);
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

// A box whose faces are finely cut, flat but for its edges, beside a torus: where that has become coarse, much of the
// box has lain where it is for long.
TriangleMesh box_and_torus() {
  TriangleMesh both = testing::make_torus(90, 60);
  const TriangleMesh ball = testing::make_sphere(60, 40);
  const auto first = static_cast<VertexId>(both.positions.size());
  for (const glm::dvec3& p : ball.positions) {
    const glm::dvec3 cube = glm::clamp(2.0 * p, glm::dvec3(-1.0), glm::dvec3(1.0));
    both.positions.push_back(cube * glm::dvec3(9.0, 6.0, 3.3) + glm::dvec3(20.0, 0.0, 0.0));
  }
  for (const Triangle& t : ball.triangles) both.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  return both;
}

TEST(PrecisionChoice, WhatIsKnownSinceAGenerationGrowsWithItUpToAllThatIsToBeSplit) {
  for (const TriangleMesh& mesh : {testing::make_torus(90, 60), box_and_torus()}) {
    const MergeHistory history = simplify(mesh, down_to(60));
    for (const LevelDistance& level : measure_level_distances(mesh, history)) {
      SCOPED_TRACE(level.vertices);
      std::uint32_t generation = 0;  // that makes the level, counted from the coarsest
      while (mesh.positions.size() - history.generation_begin[history.generation_count() - generation] < level.vertices)
        ++generation;
      ASSERT_EQ(level.known_since.size(), generation + 1U);
      for (std::size_t g = 1; g < level.known_since.size(); ++g) {
        EXPECT_GE(level.known_since[g], level.known_since[g - 1]);
      }
      EXPECT_GT(level.known_since.back(), 0.0);
      EXPECT_LE(level.known_since.back(), 1.0 + 1e-9);
    }
  }
}

TEST(PrecisionChoice, PlacesThatStayAreAsExactAsTheLevelsThatShowThem) {
  constexpr double kNoise = 0.15;
  for (const TriangleMesh& mesh : {testing::make_torus(90, 60), box_and_torus()}) {
    const MergeHistory history = simplify(mesh, down_to(60));
    const PositionGrid grid = PositionGrid::fit(mesh.positions, 12);
    const PlacePrecision precision = choose_precision(mesh, history, grid, kNoise);
    EXPECT_FALSE(precision.is_exact());
    for (const LevelDistance& level : measure_level_distances(mesh, history)) {
      const double off = level.rms / grid.step();
      for (std::uint32_t g = 0; g < level.known_since.size(); ++g) {
        const double cell = std::exp2(2.0 * precision.left_out(g)) / 12.0;  // mean square, in steps of the grid
        if (precision.left_out(g) == 0) continue;
        EXPECT_LE(cell * level.known_since[g], kNoise * (off * off + 0.1)) << level.vertices << " since " << g;
      }
    }
  }
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
