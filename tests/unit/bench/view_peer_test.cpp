#include "tests/bench/view_peer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/bench/peer_level.h"
#include "tests/bench/view_bytes.h"
#include "tests/support/mesh_generators.h"
#include "tests/unit/bench/built_asset.h"

namespace fanstream::bench {
namespace {

// A square of side 2 in the plane z = `z`, facing +z.
TriangleMesh square(double z) {
  TriangleMesh mesh;
  mesh.positions = {{-1, -1, z}, {1, -1, z}, {1, 1, z}, {-1, 1, z}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

View view_from(const glm::dvec3& eye) {
  View view;
  view.camera.eye = eye;
  view.camera.fov_deg = 60.0;
  view.near_distance = 0.01;
  return view;
}

double focal_px(const View& view) { return view.height_px / (2.0 * std::tan(std::numbers::pi / 6.0)); }

TriangleMesh full_model(const std::shared_ptr<const OpenAsset>& asset, const View& view) {
  Result<ViewDelivery> delivery = ViewDelivery::start(asset);
  EXPECT_TRUE(delivery && delivery->deliver(view, everything_wanted(), StopAt::nothing_wanted));
  return delivery->model().mesh().triangle_mesh();
}

TEST(PictureError, OfTheModelItselfIsNone) {
  const TriangleMesh mesh = testing::make_torus(30, 20);
  const PictureError error(mesh, whole_view(mesh.positions), 1'000);
  EXPECT_GT(error.sample_count(), 300U);
  EXPECT_LT(error.sample_count(), 700U);  // about half of a torus faces the eye
  EXPECT_NEAR(*error.of(mesh), 0.0, 1e-6);
}

TEST(PictureError, IsWhatAPointMovesByInThePicture) {
  const View view = view_from({0, 0, 4});
  const TriangleMesh full = square(0.0);
  const PictureError error(full, view, 2'000);
  EXPECT_EQ(error.sample_count(), 2'000U);
  TriangleMesh narrow = full;  // its right edge is missing: the samples there are nearest to where it ends now
  for (glm::dvec3& p : narrow.positions) p.x = std::min(p.x, 0.8);
  const double most = focal_px(view) * 0.2 / 4.0;
  EXPECT_LE(*error.of(narrow), most);
  EXPECT_GT(*error.of(narrow), 0.98 * most);
  // Nearer by 1: a point in the corner of the square appears further outwards, by 1/3 against 1/4 of its distance.
  const double outwards = focal_px(view) * std::sqrt(2.0) * (1.0 / 3.0 - 1.0 / 4.0);
  EXPECT_LE(*error.of(square(1.0)), outwards);
  EXPECT_GT(*error.of(square(1.0)), 0.95 * outwards);
}

TEST(PictureError, CountsWhatFacesTheEyeInThePicture) {
  EXPECT_EQ(PictureError(square(0.0), view_from({0, 0, -4}), 100).sample_count(), 0U);
  EXPECT_EQ(*PictureError(square(0.0), view_from({0, 0, -4}), 100).of(square(1.0)), 0.0);
  View beside = view_from({0, 0, 1});
  beside.camera.target = {0.5, 0, 0};
  const std::size_t seen = PictureError(square(0.0), beside, 1'000).sample_count();
  EXPECT_GT(seen, 100U);
  EXPECT_LT(seen, 900U);
}

TEST(FewestTriangles, AreFoundToAThousandth) {
  for (const std::size_t wanted : {9UL, 10UL, 500UL, 51'234UL, 99'999UL, 100'000UL}) {
    std::size_t asked = 0;
    const Result<std::size_t> found = fewest_triangles(100'000, [&](std::size_t triangles) -> Result<bool> {
      ++asked;
      return triangles >= wanted;
    });
    ASSERT_TRUE(found);
    EXPECT_GE(*found, wanted);
    EXPECT_LE(*found, wanted + std::max<std::size_t>(1, wanted / 500));
    EXPECT_LT(asked, 40U);
  }
  const auto fails = [](std::size_t) -> Result<bool> { return fail(ErrorKind::bad_input, "no level"); };
  EXPECT_EQ(fewest_triangles(100'000, fails).error().message, "no level");
}

TEST(ViewsBesidePeer, BothKeepTheToleranceAndTakeMoreForLess) {
  const TriangleMesh terrain = testing::make_terrain(90, 80, 3);
  const auto asset = built_asset(terrain, small_cells());
  ASSERT_TRUE(asset);
  const View view = whole_view(terrain.positions);
  const auto measured = measure_views_beside_peer(asset, full_model(asset, view), view, {8.0, 2.0}, 5'000);
  ASSERT_TRUE(measured) << measured.error().message;
  ASSERT_EQ(measured->size(), 2U);
  for (const ViewBesidePeer& v : *measured) {
    EXPECT_LE(v.stated_px, v.tolerance_px);
    EXPECT_LE(v.measured_px, v.stated_px);
    EXPECT_GT(v.measured_px, 0.2 * v.stated_px);
    EXPECT_LE(v.peer.error_px, v.tolerance_px);
    EXPECT_GT(v.peer.triangles, 8U);
    EXPECT_GT(v.peer.facing_bytes, 0U);
  }
  EXPECT_LT((*measured)[0].bytes, (*measured)[1].bytes);
  EXPECT_LT((*measured)[0].peer.bytes, (*measured)[1].peer.bytes);
}

}  // namespace
}  // namespace fanstream::bench
