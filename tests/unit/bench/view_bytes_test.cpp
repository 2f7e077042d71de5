#include "tests/bench/view_bytes.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "tests/bench/close_up.h"
#include "tests/bench/move_rate.h"
#include "tests/support/mesh_generators.h"
#include "tests/unit/bench/built_asset.h"
#include "tests/unit/common/geometry/geometry_shapes.h"

namespace fanstream::bench {
namespace {

struct Example {
  std::shared_ptr<const OpenAsset> asset;
  TriangleMesh full;
  View view;

  explicit Example(const TriangleMesh& mesh = testing::make_torus(120, 90)) {
    Result<BuiltAsset> built = build_asset(mesh, small_cells());
    full = rebuild_fully(built.value().bytes, "example").value()->triangle_mesh();
    asset = OpenAsset::open(std::move(built->bytes), "example").value();
    view = whole_view(full.positions);
  }
};

PlanOptions plain(double tolerance_px) {
  PlanOptions options;
  options.criteria = plain_criteria();
  options.tolerance_px = tolerance_px;
  return options;
}

Result<ViewBytes> delivered(const Example& example, const PlanOptions& options, StopAt stop) {
  Result<ViewDelivery> delivery = ViewDelivery::start(example.asset);
  if (!delivery) return tl::unexpected(delivery.error());
  return delivery->deliver(example.view, options, stop);
}

// With the pages, which are wanted and sent like segments.
std::uint64_t all_segment_bytes(const OpenAsset& asset) {
  const AssetIndex& index = *asset.asset_index();
  std::uint64_t sum = 0;
  for (const SegmentEntry& segment : index.segments) sum += segment.size_bytes;
  for (const CellEntry& cell : index.cells) sum += cell.page_bytes;
  return sum;
}

TEST(ViewDelivery, StatesWhatWasAskedForAndAFinerToleranceTakesMore) {
  const Example example;
  std::uint64_t before = 0;
  for (const double tolerance_px : {32.0, 8.0, 2.0}) {
    const Result<ViewBytes> bytes = delivered(example, plain(tolerance_px), StopAt::stated_error);
    ASSERT_TRUE(bytes) << bytes.error().message;
    EXPECT_LE(bytes->stated_error_px, tolerance_px);
    EXPECT_GT(bytes->segment_bytes, before);
    EXPECT_LT(bytes->segment_bytes, all_segment_bytes(*example.asset));
    before = bytes->segment_bytes;
  }
}

TEST(ViewDelivery, GoesOnFromWhatIsThere) {
  const Example example;
  Result<ViewDelivery> delivery = ViewDelivery::start(example.asset);
  ASSERT_TRUE(delivery);
  const Result<ViewBytes> coarse = delivery->deliver(example.view, plain(8.0), StopAt::stated_error);
  ASSERT_TRUE(coarse) << coarse.error().message;
  const Result<ViewBytes> again = delivery->deliver(example.view, plain(8.0), StopAt::stated_error);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->segment_bytes, coarse->segment_bytes);
  const Result<ViewBytes> fine = delivery->deliver(example.view, plain(2.0), StopAt::stated_error);
  ASSERT_TRUE(fine);
  EXPECT_GT(fine->segment_bytes, coarse->segment_bytes);
}

TEST(ViewDelivery, EverythingWantedIsTheFullModel) {
  const Example example;
  const Result<ViewBytes> bytes = delivered(example, everything_wanted(), StopAt::nothing_wanted);
  ASSERT_TRUE(bytes) << bytes.error().message;
  EXPECT_EQ(bytes->segment_bytes, all_segment_bytes(*example.asset));
  EXPECT_EQ(bytes->triangles, example.full.triangles.size());
  EXPECT_EQ(bytes->stated_error_px, 0.0);
}

TEST(ViewDelivery, TablesReadAnewChangeNothing) {
  const Example example;
  Result<ViewDelivery> own = ViewDelivery::start(example.asset, ViewDelivery::Tables::own);
  ASSERT_TRUE(own) << own.error().message;
  const Result<ViewBytes> a = own->deliver(example.view, plain(4.0), StopAt::stated_error);
  const Result<ViewBytes> b = delivered(example, plain(4.0), StopAt::stated_error);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->segment_bytes, b->segment_bytes);
  EXPECT_EQ(a->triangles, b->triangles);
}

TEST(ViewDelivery, AViewThatIsNoneIsAnError) {
  Example example;
  example.view.camera.eye = example.view.camera.target;
  EXPECT_FALSE(delivered(example, plain(1.0), StopAt::stated_error));
}

TEST(ShareInPicture, IsTheAreaInsideTheFourSides) {
  const TriangleMesh square = geometry_shapes::flat_square(200, 0.0);
  View view;
  view.width_px = 200;
  view.height_px = 100;
  view.camera.fov_deg = 90.0;
  view.camera.target = {0.5, 0.5, 0.0};
  view.camera.eye = {0.5, 0.5, 0.2};  // sees 0.8 by 0.4
  view.near_distance = 0.01;
  EXPECT_NEAR(share_in_picture(square, view), 0.32, 0.01);
  view.camera.eye.z = 2.0;
  EXPECT_DOUBLE_EQ(share_in_picture(square, view), 1.0);
  view.near_distance = 2.1;
  EXPECT_EQ(share_in_picture(square, view), 0.0);
  view.near_distance = 0.01;
  view.camera.target.z = 4.0;  // looks away
  EXPECT_EQ(share_in_picture(square, view), 0.0);
}

TEST(ShareInPicture, OfASphereLessThanHalfFacesTheEye) {
  const TriangleMesh sphere = geometry_shapes::octasphere(6, 2.0);
  const View view = whole_view(sphere.positions);
  EXPECT_DOUBLE_EQ(share_in_picture(sphere, view), 1.0);
  // The cap that an eye at distance d sees: (1 - r / d) / 2.
  const double distance = glm::length(view.camera.eye);
  EXPECT_NEAR(share_in_picture(sphere, view, Counted::facing), 0.5 * (1.0 - 2.0 / distance), 0.01);
}

TEST(CloseView, ShowsTheShareAskedFor) {
  for (const TriangleMesh& mesh : {geometry_shapes::flat_square(100, 1.0), testing::make_terrain(90, 80, 4)}) {
    for (const double share : {0.02, 0.1}) {
      const CloseView close = close_view(mesh, share, Counted::all);
      EXPECT_NEAR(close.share, share, 0.002);
      EXPECT_LE(close.facing_share, close.share);
      EXPECT_DOUBLE_EQ(close.share, share_in_picture(mesh, close.view));
      EXPECT_GT(close.distance, 0.0);
    }
  }
}

TEST(CloseView, OfASphereWhatFacesTheEyeIsThatShare) {
  const TriangleMesh sphere = geometry_shapes::octasphere(6, 3.0);
  const CloseView close = close_view(sphere, 0.1, Counted::facing);
  EXPECT_NEAR(close.facing_share, 0.1, 0.002);
  EXPECT_GT(close.share, close.facing_share);  // the far side is in the picture too
  // All of it faces away or is beyond the picture from the start: the eye stays where it was.
  const CloseView far = close_view(sphere, 0.6, Counted::facing);
  EXPECT_LT(far.facing_share, 0.5);
  EXPECT_NEAR(glm::length(far.view.camera.eye - whole_view(sphere.positions).camera.eye), 0.0, 1e-6);
}

TEST(CloseUp, TakesLessThanWhatItsCameraDoesNotSee) {
  const Example example(testing::make_terrain(170, 150, 8));
  const Result<CloseUp> close = measure_close_up(example.asset, example.full, 0.03, Counted::all, 8.0);
  ASSERT_TRUE(close) << close.error().message;
  EXPECT_GT(close->in_picture_bytes, 0U);
  EXPECT_LT(close->in_picture_bytes, close->facing_bytes);
  EXPECT_LE(close->facing_bytes, close->everything_bytes);
  EXPECT_LE(close->everything_bytes, all_segment_bytes(*example.asset));
  EXPECT_GT(close->even_bytes, close->in_picture_bytes);
  EXPECT_LE(close->even_bytes, all_segment_bytes(*example.asset));
}

TEST(MoveRates, CountEverySplit) {
  const Example example;
  const Result<MoveRates> rates = measure_move_rates(*example.asset, 2);
  ASSERT_TRUE(rates) << rates.error().message;
  EXPECT_EQ(rates->splits, example.full.positions.size() - example.asset->asset_head()->base.places.size());
  EXPECT_GT(rates->apply_per_s, 0.0);
  EXPECT_GT(rates->undo_per_s, 0.0);
  EXPECT_GT(rates->reapply_per_s, 0.0);
}

TEST(ClientMemory, IsMeasuredInAProcessOfItsOwn) {
  const Example example;
  const Result<ClientMemory> full =
      measure_client_memory(example.asset, example.view, everything_wanted(), StopAt::nothing_wanted);
  ASSERT_TRUE(full) << full.error().message;
  EXPECT_EQ(full->triangles, example.full.triangles.size());
  EXPECT_GT(full->counted_bytes, 0U);
  EXPECT_GT(full->grown_bytes, full->counted_bytes / 2);
  PlanOptions impossible = plain(1.0);
  impossible.max_triangles = 1;
  const Result<ClientMemory> failed =
      measure_client_memory(example.asset, example.view, impossible, StopAt::stated_error);
  ASSERT_FALSE(failed);
  EXPECT_NE(failed.error().message.find("not served"), std::string::npos) << failed.error().message;
}

}  // namespace
}  // namespace fanstream::bench
