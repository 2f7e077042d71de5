#include "client/session/draco_peer.h"

#include <gtest/gtest.h>

#include "common/asset/asset_file.h"
#include "common/refine/full_mesh.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/small_assets.h"

namespace fanstream {
namespace {

TEST(DracoPeer, TakesAnAssetsFullModelAsItLiesOnItsGrid) {
  const auto asset = AssetFile::from_memory(testing::small_asset(), "torus").value();
  const auto full = load_full(*asset).value();
  const double step = asset->asset_head()->grid.step();
  const TriangleMesh mesh = full->triangle_mesh();
  const Result<GridMesh> grid = grid_mesh(mesh, step);
  ASSERT_TRUE(grid) << grid.error().message;
  EXPECT_EQ(grid->triangles, mesh.triangles);
  const glm::dvec3 low = bounds_of(mesh.positions).low;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      const double back = low[axis] + step * grid->positions[v][static_cast<std::size_t>(axis)];
      ASSERT_NEAR(back, mesh.positions[v][axis], 1e-9 * step + 1e-12);
    }
  }
  const Result<DracoFile> file = make_draco_file(*grid, 10);
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_GT(file->decode_seconds, 0.0);
  // Between half a byte and eight a triangle: neither empty nor raw.
  EXPECT_GT(file->bytes.size(), mesh.triangles.size() / 2);
  EXPECT_LT(file->bytes.size(), 8 * mesh.triangles.size());
}

TEST(DracoPeer, RefusesAModelThatIsNotOnTheGrid) {
  TriangleMesh mesh = testing::make_grid(4, 4);
  EXPECT_TRUE(grid_mesh(mesh, 1.0));
  EXPECT_EQ(grid_mesh(mesh, 1e-12).error().kind, ErrorKind::limit);
  mesh.positions[3].x += 0.3;
  EXPECT_EQ(grid_mesh(mesh, 1.0).error().message, "Draco: vertex 3 is not on the grid");
}

TEST(DracoPeer, ShowsNothingBeforeAllHasComeAndIsDecoded) {
  DracoFile file;
  file.bytes.resize(125'000);
  file.decode_seconds = 0.25;
  const PeerDownload download = download_of(file, symmetric_link(10.0, 50.0));
  EXPECT_EQ(download.size_bytes, 125'000U);
  EXPECT_NEAR(download.download_s, 0.2, 1e-12);
  EXPECT_NEAR(download.picture_s(), 0.45, 1e-12);
}

}  // namespace
}  // namespace fanstream
