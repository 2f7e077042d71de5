// The error that a plan states bounds what can be measured on the picture: no point of the full model that faces the
// eye inside the view is drawn further from its place than that, whatever has arrived so far.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>

#include "client/session/view_model.h"
#include "common/geometry/triangle_tree.h"
#include "tests/support/asset_helpers.h"
#include "tests/support/cleaned_shared_mesh.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/projection.h"
#include "tests/support/random_directions.h"

namespace fanstream {
namespace {

constexpr int kViews = 80;  // of each model

using testing::OpenAsset;
using testing::random_direction;
using testing::SeededRandom;

double between(SeededRandom& random, double low, double high) { return low + (high - low) * random.unit(); }

// From outside near and far, from inside the box, and from just above the surface; looking at or past the model.
View random_view(const TriangleMesh& full, const Bounds& bounds, SeededRandom& random) {
  const glm::dvec3 middle = 0.5 * (bounds.low + bounds.high);
  const double radius = 0.5 * bounds.diagonal();
  const auto surface_point = [&] { return full.positions[random.below(full.positions.size())]; };
  View view;
  Camera& camera = view.camera;
  switch (random.below(4)) {
    case 0: camera.eye = middle + random_direction(random) * radius * between(random, 1.1, 6.0); break;
    case 1: camera.eye = middle + random_direction(random) * radius * between(random, 0.0, 0.9); break;
    default: camera.eye = surface_point() + random_direction(random) * radius * std::pow(10.0, between(random, -3, 0));
  }
  camera.target = random.one_in(3) ? middle + random_direction(random) * radius : surface_point();
  camera.up = random_direction(random);
  camera.fov_deg = between(random, 5.0, 140.0);
  view.width_px = 64 + random.below(1500);
  view.height_px = 64 + random.below(1500);
  view.near_distance = depth_range(camera, bounds).near_distance;
  return view;
}

struct Figures {
  std::size_t views = 0;
  std::size_t finite = 0;
  std::size_t samples = 0;
  double least_slack = INFINITY;  // stated by measured, where that is not next to nothing
};

class ModelUnderTest {
 public:
  ModelUnderTest(const TriangleMesh& mesh, const BuildOptions& options, std::uint64_t seed)
      : asset_(testing::build_and_open(mesh, options)), random_(seed) {
    if (!asset_.head) return;
    full_ = testing::fully_refined(asset_)->triangle_mesh();
    bounds_ = bounds_of(full_.positions);
    for (const Triangle& t : full_.triangles) {
      normals_.push_back(
          glm::cross(full_.positions[t[1]] - full_.positions[t[0]], full_.positions[t[2]] - full_.positions[t[0]]));
    }
  }

  void expect_stated_errors_hold(int views, Figures& figures) {
    ASSERT_TRUE(asset_.head);
    std::unique_ptr<ViewModel> model;
    for (int i = 0; i < views; ++i) {
      SCOPED_TRACE("view " + std::to_string(i));
      if (!model || random_.one_in(3)) {
        model = std::make_unique<ViewModel>(asset_.head);
        ASSERT_TRUE(model->set_index(random_.one_in(2) ? asset_.index : asset_.first_index(), "the index"));
      }
      const View view = random_view(full_, bounds_, random_);
      PlanOptions options;
      options.tolerance_px = 0.5 * std::pow(40.0, random_.unit());
      for (std::uint32_t round = random_.below(5); round > 0; --round) receive_some(*model, view, options);
      measure(*model, view, options, figures);
      if (::testing::Test::HasFailure()) return;
    }
  }

 private:
  // Some of what is wanted comes; some cells are lucky and some are not, as wants are sent in order but cut off.
  void receive_some(ViewModel& model, const View& view, const PlanOptions& options) {
    const Plan& plan = model.plan(view, options);
    const std::size_t unlucky = 2 + random_.below(6);
    for (const Want& want : plan.wants) {
      if (random_.one_in(static_cast<std::uint32_t>(unlucky))) continue;
      for (std::uint32_t s = 0; s < want.prefix; ++s) {
        if (asset_.segment(want.cell, s).empty() || model.mesh().holds(want.cell, s)) continue;
        ASSERT_TRUE(model.add_segment(want.cell, s, asset_.segment(want.cell, s)));
      }
    }
    (void)model.apply(random_.one_in(3) ? 1 + random_.below(2000) : ProgressiveMesh::kNoBudget);
    if (random_.one_in(2)) (void)model.evict();
  }

  void measure(ViewModel& model, const View& view, const PlanOptions& options, Figures& figures) {
    const Plan& plan = model.plan(view, options);
    ++figures.views;
    if (!std::isfinite(plan.stated_error_px)) return;
    ++figures.finite;
    const double stated = plan.stated_error_px;
    const TriangleMesh shown = model.mesh().triangle_mesh();
    const auto tree = TriangleTree::build(shown);
    ASSERT_TRUE(tree);
    const testing::Projection projection(view);
    constexpr std::size_t kTriangles = 3000;
    double farthest = 0.0;
    glm::dvec3 where(0.0);
    std::uint32_t hint = 0;
    const std::size_t step = std::max<std::size_t>(1, full_.triangles.size() / kTriangles);
    for (std::size_t t = random_.below(step); t < full_.triangles.size(); t += step) {
      const Triangle& triangle = full_.triangles[t];
      const glm::dvec3& a = full_.positions[triangle[0]];
      for (int sample = 0; sample < 3; ++sample) {
        const double u = sample == 0 ? 0.0 : std::sqrt(random_.unit());
        const double v = random_.unit();
        const glm::dvec3 p =
            a + u * (1.0 - v) * (full_.positions[triangle[1]] - a) + u * v * (full_.positions[triangle[2]] - a);
        if (glm::dot(normals_[t], view.camera.eye - p) <= 0.0 || !projection.is_drawn(p)) continue;
        const glm::dvec2 belongs = projection.pixel(p);
        if (!projection.is_inside(belongs)) continue;
        const SurfacePoint nearest = tree->closest(p, hint);
        hint = nearest.slot;
        if (!projection.is_drawn(nearest.position)) continue;
        ++figures.samples;
        const double off = glm::length(projection.pixel(nearest.position) - belongs);
        if (off <= farthest) continue;
        farthest = off;
        where = p;
      }
    }
    EXPECT_LE(farthest, stated * (1.0 + 1e-9) + 1e-6)
        << "at " << where.x << ' ' << where.y << ' ' << where.z << " of the model, seen from " << view.camera.eye.x
        << ' ' << view.camera.eye.y << ' ' << view.camera.eye.z;
    if (farthest > 1e-3) figures.least_slack = std::min(figures.least_slack, stated / farthest);
  }

  OpenAsset asset_;
  SeededRandom random_;
  TriangleMesh full_;
  Bounds bounds_;
  std::vector<glm::dvec3> normals_;  // by triangle of the full model, of any length
};

void report(const std::string& name, const Figures& figures) {
  std::printf("[  figures ] %s: %zu of %zu views with a finite error, %zu samples, stated at least %.2f of measured\n",
              name.c_str(), figures.finite, figures.views, figures.samples, figures.least_slack);
  EXPECT_GT(2 * figures.finite, figures.views);
}

TEST(StatedError, BoundsWhatIsSeenOfGeneratedModels) {
  for (const auto& [name, mesh] : testing::model_shapes()) {
    if (mesh.triangles.size() < 500) continue;
    for (const std::uint64_t seed : {1, 2}) {
      SCOPED_TRACE(name + ", seed " + std::to_string(seed));
      Figures figures;
      ModelUnderTest(mesh, testing::small_cells(), seed).expect_stated_errors_hold(kViews, figures);
      report(name, figures);
    }
  }
}

class SharedMeshStatedError : public ::testing::TestWithParam<const char*> {};

TEST_P(SharedMeshStatedError, BoundsWhatIsSeen) {
  const auto mesh = testing::cleaned_shared_mesh(GetParam());
  if (!mesh) GTEST_SKIP() << GetParam() << " is not there (../shared/data)";
  BuildOptions options;
  options.position_bits = 12;
  options.segment_splits = 20.0;
  Figures figures;
  ModelUnderTest(*mesh, options, 5).expect_stated_errors_hold(kViews, figures);
  report(GetParam(), figures);
}

INSTANTIATE_TEST_SUITE_P(Real, SharedMeshStatedError,
                         ::testing::Values("stanford_bunny_zipper.ply", "fandisk_13k.obj", "cow_2904v.off",
                                           "mountain_terrain_51k_open.ply"),
                         [](const auto& parameter) {
                           const std::string file = parameter.param;
                           return file.substr(0, file.find('.'));
                         });

}  // namespace
}  // namespace fanstream
