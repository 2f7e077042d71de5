#include "client/smooth/finest_need.h"

#include <gtest/gtest.h>

#include <cmath>

#include "client/session/view_model.h"
#include "tests/support/asset_helpers.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

using testing::OpenAsset;

// A model of which all that is held has been applied, and what the table knows of it.
struct Loaded {
  explicit Loaded(const TriangleMesh& mesh) : bounds(bounds_of(mesh.positions)) {
    asset = testing::build_and_open(mesh);
    model = std::make_unique<ViewModel>(asset.head);
    EXPECT_TRUE(model->set_index(asset.index, "the index"));
    for (const auto& [cell, segment] : asset.segments()) {
      EXPECT_TRUE(model->add_segment(cell, segment, asset.segment(cell, segment)));
    }
  }
  View view(double distance, std::uint32_t width, std::uint32_t height) const {
    View view;
    view.camera = fit(bounds);
    view.camera.eye = view.camera.target + distance * (view.camera.eye - view.camera.target);
    view.width_px = width;
    view.height_px = height;
    view.near_distance = depth_range(view.camera, bounds).near_distance;
    return view;
  }
  void apply(const View& view, double tolerance_px) {
    PlanOptions options;
    options.tolerance_px = tolerance_px;
    for (int round = 0; round < 4; ++round) {
      model->plan(view, options);
      (void)model->apply();
    }
  }

  Bounds bounds;
  OpenAsset asset;
  std::unique_ptr<ViewModel> model;
};

TEST(FinestNeed, CountsTheTrianglesThatWillBeThereHoweverFarTheMeshIs) {
  const TriangleMesh torus = testing::make_torus(40, 30);
  Loaded loaded(torus);
  FinestNeed need(*loaded.asset.head, *loaded.asset.index);
  const View all = loaded.view(1.0, 640, 480);
  for (const double tolerance_px : {1e6, 20.0, 1.0, 0.0}) {
    loaded.apply(all, tolerance_px);
    (void)need.decide(all, {}, loaded.model->table(), loaded.model->mesh());
    EXPECT_NEAR(need.finest_triangles(), static_cast<double>(torus.triangles.size()), 1.0) << tolerance_px;
  }
}

TEST(FinestNeed, IsOfLargePicturesAndCloseViews) {
  Loaded loaded(testing::make_torus(40, 30));  // 2,400 triangles
  const auto needed = [&](const View& view) {
    loaded.apply(view, 0.0);
    return FinestNeed(*loaded.asset.head, *loaded.asset.index)
        .decide(view, {}, loaded.model->table(), loaded.model->mesh());
  };
  EXPECT_FALSE(needed(loaded.view(1.0, 150, 120)));
  EXPECT_TRUE(needed(loaded.view(1.0, 160, 130)));
  View aside = loaded.view(0.5, 150, 120);
  for (glm::dvec3* place : {&aside.camera.eye, &aside.camera.target}) *place += glm::dvec3(1.2, 0.0, -0.6);
  EXPECT_TRUE(needed(aside)) << "less of it is in the picture";
}

TEST(FinestNeed, DoesNotTremble) {
  Loaded loaded(testing::make_torus(40, 30));
  FinestNeed need(*loaded.asset.head, *loaded.asset.index);
  const auto decide = [&](std::uint32_t pixels) {
    const View view = loaded.view(1.0, pixels / 100, 100);
    loaded.apply(view, 0.0);
    return need.decide(view, {}, loaded.model->table(), loaded.model->mesh());
  };
  const auto triangles = 2400U;
  EXPECT_FALSE(decide(7 * triangles));
  EXPECT_TRUE(decide(9 * triangles));
  EXPECT_TRUE(decide(7 * triangles));
  EXPECT_FALSE(decide(5 * triangles));
  EXPECT_FALSE(decide(7 * triangles));
}

}  // namespace
}  // namespace fanstream
