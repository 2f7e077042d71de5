#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "common/geometry/mesh_distance.h"
#include "tests/bench/draco_peer.h"
#include "tests/bench/meshoptimizer_peer.h"
#include "tests/unit/common/geometry/geometry_shapes.h"

namespace fanstream::bench {
namespace {

using geometry_shapes::flat_square;
using geometry_shapes::octasphere;

TEST(OnGrid, LongestSideFillsTheGridAndStepsAreTheSameForAllAxes) {
  TriangleMesh mesh;
  mesh.positions = {{-1, 10, 5}, {7, 12, 5}, {3, 11, 5.0009}};
  mesh.triangles = {{0, 1, 2}};
  const GridMesh grid = on_grid(mesh, 12);
  using P = std::array<std::int32_t, 3>;
  EXPECT_EQ(grid.positions[0], (P{0, 0, 0}));
  EXPECT_EQ(grid.positions[1], (P{4095, 1024, 0}));  // 2 / 8 * 4095 = 1023.75
  EXPECT_EQ(grid.positions[2], (P{2048, 512, 0}));   // 2047.5 is rounded up
  EXPECT_EQ(grid.triangles, mesh.triangles);
}

TEST(OnGrid, VerticesThatShareAGridPointSurvive) {
  const TriangleMesh mesh = octasphere(5, 1.0);
  const GridMesh grid = on_grid(mesh, 3);
  EXPECT_EQ(grid.positions.size(), mesh.positions.size());
  EXPECT_LE(std::set(grid.positions.begin(), grid.positions.end()).size(), 512U);
  TriangleMesh point;
  point.positions = {{3, 3, 3}, {3, 3, 3}, {3, 3, 3}};
  EXPECT_EQ(on_grid(point, 12).positions.size(), 3U);
}

TEST(DracoPeer, EveryLevelGivesBackAllTrianglesEvenWhereGridPointsCoincide) {
  for (const unsigned bits : {4U, 12U}) {
    const GridMesh grid = on_grid(octasphere(4, 1.0), bits);
    for (const int level : {0, 7, 10}) {
      const Result<DracoResult> result = measure_draco(grid, level, 2);
      ASSERT_TRUE(result) << result.error().message;
      EXPECT_GT(result->size_bytes, 100U);
      EXPECT_DOUBLE_EQ(result->bits_per_vertex,
                       8.0 * static_cast<double>(result->size_bytes) / static_cast<double>(grid.positions.size()));
      EXPECT_GT(result->decode_mtriangles_s, 0.0);
    }
  }
}

TEST(DracoPeer, HigherLevelsAndCoarserGridsAreSmaller) {
  const TriangleMesh mesh = octasphere(5, 1.0);
  const auto size = [&](unsigned bits, int level) {
    return measure_draco(on_grid(mesh, bits), level, 1).value_or(DracoResult{}).size_bytes;
  };
  EXPECT_LT(size(12, 10), size(12, 7));
  EXPECT_LT(size(12, 7), size(12, 0));
  EXPECT_LT(size(8, 10), size(12, 10));
  EXPECT_GT(size(8, 10), 0U);
}

TEST(DracoPeer, RefusesWhatItCannotMeasure) {
  const GridMesh grid = on_grid(octasphere(1, 1.0), 8);
  EXPECT_EQ(measure_draco(grid, 11).error().kind, ErrorKind::usage);
  EXPECT_EQ(measure_draco(grid, 7, 0).error().kind, ErrorKind::usage);
  EXPECT_EQ(measure_draco({}, 7).error().kind, ErrorKind::bad_input);
  GridMesh broken = grid;
  broken.triangles[1][2] = 18;
  EXPECT_EQ(measure_draco(broken, 7).error().message, "triangle 1 names vertex 18 of 18");
}

TEST(MeshoptimizerPeer, ReachesItsTargetOnASphereAndStaysCloseToIt) {
  const TriangleMesh mesh = octasphere(5, 1.0);
  const Result<SimplifyResult> simplified = simplify_with_meshoptimizer(mesh, {mesh.triangles.size() / 10});
  ASSERT_TRUE(simplified);
  EXPECT_LE(simplified->mesh.triangles.size(), mesh.triangles.size() / 10);
  EXPECT_GE(simplified->mesh.triangles.size(), mesh.triangles.size() / 10 - 4);
  // Every vertex is used, and is one of the original's.
  EXPECT_EQ(simplified->mesh.positions.size(), simplified->mesh.triangles.size() / 2 + 2);
  for (const glm::dvec3& p : simplified->mesh.positions) {
    EXPECT_NE(std::find(mesh.positions.begin(), mesh.positions.end(), p), mesh.positions.end());
  }
  const Result<MeshDistance> distance = mesh_distance(mesh, simplified->mesh, {20'000, 1});
  ASSERT_TRUE(distance);
  EXPECT_LT(distance->relative_max(), 0.01);
  EXPECT_GT(distance->relative_rms(), 1e-4);
}

TEST(MeshoptimizerPeer, LockedBordersKeepEveryBorderVertex) {
  const TriangleMesh square = flat_square(20, 0.0);
  const auto vertices_on_border = [](const TriangleMesh& mesh) {
    return std::count_if(mesh.positions.begin(), mesh.positions.end(),
                         [](const glm::dvec3& p) { return p.x == 0.0 || p.x == 1.0 || p.y == 0.0 || p.y == 1.0; });
  };
  const Result<SimplifyResult> free = simplify_with_meshoptimizer(square, {8, false});
  const Result<SimplifyResult> locked = simplify_with_meshoptimizer(square, {8, true});
  ASSERT_TRUE(free && locked);
  EXPECT_EQ(vertices_on_border(locked->mesh), 80);
  EXPECT_LT(vertices_on_border(free->mesh), 20);
  EXPECT_FALSE(simplify_with_meshoptimizer({}, {8}));
}

}  // namespace
}  // namespace fanstream::bench
