#include "tests/bench/level_quality.h"

#include <gtest/gtest.h>

#include "common/mesh/manifold_check.h"
#include "tests/bench/measure_model.h"
#include "tests/support/mesh_generators.h"
#include "tests/unit/bench/built_asset.h"

namespace fanstream::bench {
namespace {

struct Fixture {
  TriangleMesh mesh = testing::make_terrain(40, 36, 5);
  std::shared_ptr<const OpenAsset> asset = built_asset(mesh, small_cells());
  const PositionGrid& grid = asset->asset_head()->grid;
  MergeHistory history = simplify(mesh, same_options());
  CodedHistory coded{history, places(), grid, asset->asset_head()->precision};

  SimplifyOptions same_options() const { return simplify_options_of(mesh, small_cells()); }
  std::vector<GridPoint> places() const {
    std::vector<GridPoint> result;
    for (const glm::dvec3& p : mesh.positions) result.push_back(grid.encode(p));
    return result;
  }
  TriangleMesh quantised() const {
    TriangleMesh result = mesh;
    for (glm::dvec3& p : result.positions) p = grid.decode(grid.encode(p));
    return result;
  }
  GridMesh on_asset_grid(const TriangleMesh& level) const {
    GridMesh result{{}, level.triangles};
    for (const glm::dvec3& p : level.positions) {
      const GridPoint code = grid.encode(p);
      result.positions.push_back({code.x, code.y, code.z});
    }
    return result;
  }
};

TEST(LevelReplay, EveryLevelHasTheVerticesAskedForAndIsAManifold) {
  const Fixture f;
  const auto full = static_cast<std::uint32_t>(f.mesh.positions.size());
  LevelReplay replay(f.coded, f.grid, full);
  EXPECT_EQ(replay.vertex_count(), f.history.base_vertices);
  for (std::uint32_t n = replay.vertex_count(); n < full; n += 97) {
    replay.refine_to(n);
    const TriangleMesh level = replay.mesh();
    EXPECT_EQ(level.positions.size(), n);
    std::string why;
    EXPECT_TRUE(is_oriented_manifold(level, &why)) << n << " vertices: " << why;
  }
}

TEST(LevelReplay, TheLastLevelIsTheQuantisedModel) {
  const Fixture f;
  const auto full = static_cast<std::uint32_t>(f.mesh.positions.size());
  LevelReplay replay(f.coded, f.grid, full);
  replay.refine_to(full - 1);
  EXPECT_FALSE(same_triangles(f.on_asset_grid(replay.mesh()), f.on_asset_grid(f.quantised())));
  replay.refine_to(full);
  EXPECT_TRUE(same_triangles(f.on_asset_grid(replay.mesh()), f.on_asset_grid(f.quantised())));
}

TEST(LevelReplay, AtTheEndsOfLayersAClientHasTheSameMesh) {
  const Fixture f;
  const AssetHead& head = *f.asset->asset_head();
  LevelReplay replay(f.coded, f.grid, head.vertex_count);
  ProgressiveMesh client(f.asset->asset_head());
  client.set_index(f.asset->asset_index());
  for (std::uint32_t layer = 0; layer < head.layer_ends.size(); ++layer) {
    for (std::uint32_t c = 0; c < f.asset->cell_count(); ++c) {
      const std::uint32_t slab = f.asset->asset_index()->cells[c].slab;
      if (layer < head.layer_begin(slab) || layer >= head.slab_ends[slab]) continue;
      const std::uint32_t segment = layer - head.layer_begin(slab);
      ASSERT_TRUE(client.add_segment(c, segment, f.asset->segment(c, segment)));
    }
    ASSERT_TRUE(client.refine());
    replay.refine_to(client.vertex_count());
    EXPECT_TRUE(same_triangles(f.on_asset_grid(replay.mesh()), f.on_asset_grid(client.triangle_mesh()))) << layer;
  }
  EXPECT_TRUE(client.is_complete());
}

TEST(MeasureLevels, CoarserLevelsAreFartherOffAndTheWholeModelIsExact) {
  const Fixture f;
  const std::vector<double> shares{1.0, 0.5, 0.2, 0.001};
  const auto levels = measure_levels(f.quantised(), f.mesh, f.coded, f.grid, shares, 5'000);
  ASSERT_TRUE(levels) << levels.error().message;
  ASSERT_EQ(levels->size(), 3U);  // 0.1 % would be fewer vertices than FM0 has
  EXPECT_NEAR((*levels)[0].ours.rms, 0.0, 1e-12);
  EXPECT_LT((*levels)[0].ours.rms, (*levels)[1].ours.rms);
  EXPECT_LT((*levels)[1].ours.rms, (*levels)[2].ours.rms);
  for (const LevelQuality& level : *levels) {
    EXPECT_LE(level.ours.rms, level.ours.max);
    EXPECT_TRUE(LevelQuality::comparable(level.ours, level.peer));
    EXPECT_TRUE(LevelQuality::comparable(level.ours, level.peer_original));
  }
}

}  // namespace
}  // namespace fanstream::bench
