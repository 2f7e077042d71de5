// What holds whatever orders the merges and wherever their parents go.
#include "tests/support/every_cost.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>

#include "common/geometry/mesh_distance.h"
#include "tests/support/asset_helpers.h"
#include "tests/support/cleaned_shared_mesh.h"
#include "tests/support/measured_levels.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/ring_views.h"

namespace fanstream {
namespace {

using testing::every_cost;
using testing::text_of;

class EveryCost : public ::testing::TestWithParam<std::size_t> {
 protected:
  static CostOptions cost() { return every_cost()[GetParam()]; }
};

// Full refinement is the quantised input face for face; undoing everything gives back FM0 exactly, and refining again
// the same.
void expect_exact(const TriangleMesh& mesh, const BuildOptions& options) {
  const testing::OpenAsset asset = testing::build_and_open(mesh, options);
  ASSERT_TRUE(asset.head);
  const auto refined = testing::fully_refined(asset);
  ASSERT_EQ(testing::face_keys(refined->triangle_mesh()), testing::face_keys(testing::on_grid(mesh, asset.head->grid)));
  std::string why;
  ASSERT_TRUE(testing::is_manifold(*refined, &why)) << why;
  const testing::StateImage full = testing::image_of(*refined);
  const testing::StateImage base = testing::image_of(*testing::start(asset));
  refined->coarsen_to(0);
  ASSERT_TRUE(testing::image_of(*refined) == base);
  ASSERT_TRUE(refined->refine());
  ASSERT_TRUE(testing::image_of(*refined) == full);
}

TEST_P(EveryCost, RefinementAndCoarseningAreExactOnEveryShape) {
  constexpr int kBits[] = {kLeastPositionBits, 14, kMostPositionBits};
  int turn = 0;
  for (const auto& [name, mesh] : testing::model_shapes()) {
    BuildOptions options = testing::small_cells();
    options.position_bits = kBits[turn++ % 3];
    if (cost().cost == CostKind::fans && turn % 8 != 1) continue;  // takes long
    options.cost = cost();
    SCOPED_TRACE(name + ", " + std::to_string(*options.position_bits) + " bits, " + text_of(cost()));
    expect_exact(mesh, options);
  }
}

TEST_P(EveryCost, RefinementAndCoarseningAreExactOnARealModel) {
  const auto mesh = testing::cleaned_shared_mesh("cow_2904v.off");
  if (!mesh) GTEST_SKIP() << "no shared data";
  BuildOptions options;
  options.cost = cost();
  expect_exact(*mesh, options);
}

TEST_P(EveryCost, BoundsHoldInEveryUniformAndMixedLevel) {
  const TriangleMesh mesh = testing::make_terrain(26, 22, 11);
  const testing::MeasuredModel model(mesh, 12, 20, cost());
  const TriangleMesh full = model.full();
  for (std::uint32_t k = 1; k <= model.history.generation_count(); k += 2) {
    testing::SeededRandom random(k);
    for (const auto& level : {testing::uniform_level(model, k), testing::mixed_level(model, 3 + k, random)}) {
      const auto tree = TriangleTree::build(level.mesh);
      ASSERT_TRUE(tree);
      const auto sampled = directed_distance(full, *tree, {20'000, k});
      ASSERT_TRUE(sampled);
      EXPECT_LE(sampled->max, level.largest_pending + 1e-9 * model.grid.step()) << "seed " << k;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Costs, EveryCost, ::testing::Range<std::size_t>(0, every_cost().size()), [](const auto& cost) {
  std::string name = text_of(every_cost()[cost.param]);
  std::replace_if(
      name.begin(), name.end(), [](char c) { return std::isalnum(c) == 0; }, '_');
  return name;
});

}  // namespace
}  // namespace fanstream
