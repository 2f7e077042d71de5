#include "server/build/surface_error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>

#include "common/geometry/closest_point.h"
#include "common/geometry/mesh_distance.h"
#include "tests/support/asset_helpers.h"
#include "tests/support/cleaned_shared_mesh.h"
#include "tests/support/measured_levels.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

using testing::MeasuredModel;
using testing::mixed_level;
using testing::MixedMesh;
using testing::points_of;
using testing::SeededRandom;
using testing::uniform_level;

double distance_to(const glm::dvec3& p, const TriangleMesh& mesh, const Triangle& t) {
  return glm::distance(p,
                       closest_point_on_triangle(p, mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]));
}

// Each point of the full model must have a triangle of the mixed mesh no farther away than the error of the patch that
// made that triangle: what surface_error.h proves. Returns by how much the worst misses that.
double worst_miss(const TriangleMesh& full, const MixedMesh& mixed, std::uint32_t per_edge) {
  double worst = 0.0;
  std::size_t hint = 0;
  for (const Triangle& t : full.triangles) {
    for (const glm::dvec3& p : points_of(full, t, per_edge)) {
      double miss = distance_to(p, mixed.mesh, mixed.mesh.triangles[hint]) - mixed.errors[hint];
      for (std::size_t f = 0; f < mixed.mesh.triangles.size() && miss > 0.0; ++f) {
        const double here = distance_to(p, mixed.mesh, mixed.mesh.triangles[f]) - mixed.errors[f];
        if (here >= miss) continue;
        miss = here;
        hint = f;
      }
      worst = std::max(worst, miss);
    }
  }
  return worst;
}

// The faces around what a patch absorbs are carried by it for certain while they are the full model's own.
void expect_cones_hold(const MeasuredModel& model) {
  if (model.history.generation_count() == 0) return;
  const TriangleMesh full = model.full();
  std::vector<std::uint32_t> patch_of(full.positions.size(), kOutside);
  for (std::uint32_t m = 0; m < model.history.generation_begin[1]; ++m) {
    patch_of[model.history.merges[m].removed] = patch_of[model.history.merges[m].root] = model.errors.patch_of[m];
  }
  std::size_t checked = 0;
  for (const Triangle& t : full.triangles) {
    const glm::dvec3 normal =
        glm::cross(full.positions[t[1]] - full.positions[t[0]], full.positions[t[2]] - full.positions[t[0]]);
    if (!(glm::length(normal) > 0.0)) continue;
    for (const VertexId v : t) {
      if (patch_of[v] == kOutside) continue;
      const NormalCone& cone = model.errors.patches[patch_of[v]].normals;
      EXPECT_GE(glm::dot(glm::normalize(normal), glm::dvec3(cone.axis)), cone.cosine - 1e-6);
      ++checked;
    }
  }
  EXPECT_GT(checked, 0U);
}

const std::vector<std::pair<std::string, TriangleMesh>>& shapes() {
  static const auto all = testing::model_shapes();
  return all;
}

class SurfaceErrorOfShape : public ::testing::TestWithParam<std::size_t> {
 protected:
  static const TriangleMesh& mesh() { return shapes()[GetParam()].second; }
};

TEST_P(SurfaceErrorOfShape, EveryPointIsNearAFaceWhosePatchSaysSoInEveryUniformLevel) {
  const MeasuredModel model(mesh(), 12, 8);
  const TriangleMesh full = model.full();
  for (std::uint32_t k = 0; k <= model.history.generation_count(); k += 1 + k / 3) {
    const MixedMesh level = uniform_level(model, k);
    EXPECT_LE(worst_miss(full, level, 4), 1e-9 * model.grid.step()) << k << " generations merged";
  }
}

TEST_P(SurfaceErrorOfShape, EveryPointIsNearAFaceWhosePatchSaysSoInEveryMixedMesh) {
  const MeasuredModel model(mesh(), 12, 8);
  const TriangleMesh full = model.full();
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SeededRandom random(seed);
    const MixedMesh mixed = mixed_level(model, 2 + static_cast<std::uint32_t>(seed % 3) * 15, random);
    EXPECT_LE(worst_miss(full, mixed, 3), 1e-9 * model.grid.step()) << "seed " << seed;
  }
}

// Patches lie across the borders between parts, most of the coarse ones.
TEST_P(SurfaceErrorOfShape, MeasuredInPartsTheBoundsHoldToo) {
  const MeasuredModel whole(mesh(), 12, 8);
  const MeasuredModel model(mesh(), 12, 8, {}, 50);
  const TriangleMesh full = model.full();
  ASSERT_EQ(model.errors.patch_of, whole.errors.patch_of);
  ASSERT_EQ(model.errors.patches.size(), whole.errors.patches.size());
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SeededRandom random(seed);
    const MixedMesh mixed = mixed_level(model, 2 + static_cast<std::uint32_t>(seed % 3) * 15, random);
    EXPECT_LE(worst_miss(full, mixed, 3), 1e-9 * model.grid.step()) << "seed " << seed;
  }
}

// On a coarse grid vertices fall together and triangles lose their area.
TEST_P(SurfaceErrorOfShape, CoarseGridsWithFlatTrianglesDoNotBreakTheBound) {
  const MeasuredModel model(mesh(), kLeastPositionBits, 8);
  const TriangleMesh full = model.full();
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SeededRandom random(seed);
    const MixedMesh mixed = mixed_level(model, 2 + static_cast<std::uint32_t>(seed) * 10, random);
    EXPECT_LE(worst_miss(full, mixed, 3), 1e-9 * model.grid.step()) << "seed " << seed;
  }
  for (const PatchSurface& patch : model.errors.patches) EXPECT_TRUE(std::isfinite(patch.error));
}

TEST_P(SurfaceErrorOfShape, MeasuringTwiceGivesTheSame) {
  const MeasuredModel model(mesh(), 12, 8);
  const MeasuredModel again(mesh(), 12, 8);
  EXPECT_EQ(model.errors.patch_of, again.errors.patch_of);
  ASSERT_EQ(model.errors.patches.size(), again.errors.patches.size());
  for (std::size_t p = 0; p < model.errors.patches.size(); ++p) {
    ASSERT_EQ(model.errors.patches[p].error, again.errors.patches[p].error);
    ASSERT_EQ(model.errors.patches[p].normals.axis, again.errors.patches[p].normals.axis);
    ASSERT_EQ(model.errors.patches[p].normals.cosine, again.errors.patches[p].normals.cosine);
  }
}

TEST_P(SurfaceErrorOfShape, ConesHoldTheNormalsOfWhatThePatchHasAbsorbed) {
  expect_cones_hold(MeasuredModel(mesh(), 12, 8));
  expect_cones_hold(MeasuredModel(mesh(), 12, 8, {}, 50));
}

INSTANTIATE_TEST_SUITE_P(Shapes, SurfaceErrorOfShape, ::testing::Range<std::size_t>(0, shapes().size()),
                         [](const auto& shape) {
                           std::string name = shapes()[shape.param].first;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

TEST(SurfaceError, AFlatModelHasNoErrorToSpeakOfAndOneNormal) {
  const MeasuredModel model(testing::make_grid(40, 30), 12, 8);
  ASSERT_FALSE(model.errors.patches.empty());
  for (const PatchSurface& patch : model.errors.patches) {
    EXPECT_LE(patch.error, 0.3 * model.grid.step());
    EXPECT_GT(patch.normals.cosine, 0.9999F);
    EXPECT_GT(patch.normals.axis.z, 0.9999F);
  }
}

TEST(SurfaceError, MergesOfOnePatchShareItsError) {
  const MeasuredModel model(testing::make_sphere(40, 50), 12, 8);
  for (std::uint32_t k = 0; k < model.history.generation_count(); ++k) {
    for (std::uint32_t m = model.history.generation_begin[k]; m < model.history.generation_begin[k + 1]; ++m) {
      for (std::uint32_t n = model.history.generation_begin[k]; n < m; ++n) {
        EXPECT_EQ(model.errors.patch_of[m] == model.errors.patch_of[n],
                  model.history.merges[m].root == model.history.merges[n].root);
      }
    }
  }
}

class SurfaceErrorOfModel : public ::testing::TestWithParam<const char*> {};

TEST_P(SurfaceErrorOfModel, UniformLevelsAreBoundedAndTheBoundsAreTight) {
  const auto mesh = testing::cleaned_shared_mesh(GetParam());
  if (!mesh) GTEST_SKIP() << "no shared data";
  const MeasuredModel model(*mesh, PositionGrid::default_bits(*mesh), 100);
  const TriangleMesh full = model.full();
  for (std::uint32_t k = 1; k <= model.history.generation_count(); k += 3) {
    const MixedMesh level = uniform_level(model, k);
    const auto tree = TriangleTree::build(level.mesh);
    ASSERT_TRUE(tree);
    const auto sampled = directed_distance(full, *tree, {60'000, k});
    ASSERT_TRUE(sampled);
    EXPECT_LE(sampled->max, level.largest_pending) << k << " generations merged";
    EXPECT_LE(level.largest_pending, 1.5 * sampled->max + 0.5 * model.grid.step()) << k << " generations merged";
    std::printf("%s, %u generations merged: %.3f x the sampled distance\n", GetParam(), k,
                level.largest_pending / sampled->max);
  }
}

INSTANTIATE_TEST_SUITE_P(Models, SurfaceErrorOfModel,
                         ::testing::Values("stanford_bunny_zipper.ply", "fandisk_13k.obj",
                                           "mountain_terrain_51k_open.ply", "cow_2904v.off"),
                         [](const auto& shape) {
                           const std::string name = shape.param;
                           return name.substr(0, name.find_first_of("_."));
                         });

}  // namespace
}  // namespace fanstream
