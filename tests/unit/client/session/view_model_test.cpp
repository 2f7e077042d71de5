#include "client/session/view_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "tests/support/mesh_generators.h"
#include "tests/support/progressive_checks.h"

namespace fanstream {
namespace {

using testing::OpenAsset;
using testing::SeededRandom;

const OpenAsset& terrain() {
  static const OpenAsset built = [] {
    BuildOptions options = testing::small_cells();
    options.distance_growth = 0.0;  // merges come by cost alone
    return testing::build_and_open(testing::make_terrain(80, 70, 3), options);
  }();
  return built;
}

Bounds bounds() {
  static const Bounds all = bounds_of(testing::fully_refined(terrain())->triangle_mesh().positions);
  return all;
}

// From above and aside, near enough that much of the terrain is outside of the picture.
View view_at(double angle, double distance = 0.5) {
  const Bounds box = bounds();
  const glm::dvec3 middle = 0.5 * (box.low + box.high);
  View view;
  view.camera.target = middle + 0.2 * box.diagonal() * glm::dvec3(std::cos(angle), std::sin(angle), 0.0);
  view.camera.eye = view.camera.target + distance * box.diagonal() * glm::dvec3(-std::sin(angle), std::cos(angle), 0.8);
  view.camera.up = {0, 0, 1};
  view.width_px = 800;
  view.height_px = 600;
  view.near_distance = depth_range(view.camera, box).near_distance;
  return view;
}

std::unique_ptr<ViewModel> new_model() {
  auto model = std::make_unique<ViewModel>(terrain().head);
  EXPECT_TRUE(model->set_index(terrain().first_index(), "the index"));
  return model;
}

void add_want(ViewModel& model, const Want& want) {
  for (std::uint32_t s = 0; s < want.prefix; ++s) {
    if (model.mesh().holds(want.cell, s) || terrain().segment(want.cell, s).empty()) continue;
    ASSERT_TRUE(model.add_segment(want.cell, s, terrain().segment(want.cell, s)));
  }
}

// A client with a link without end: takes all that is wanted until nothing is. False if that never comes.
bool settle(ViewModel& model, const View& view, const PlanOptions& options) {
  for (int round = 0; round < 200; ++round) {
    const Plan plan = model.plan(view, options);
    if (plan.settled) return true;
    for (const Want& want : plan.wants) add_want(model, want);
    (void)model.apply();
    (void)model.plan(view, options);
    (void)model.evict();
  }
  return false;
}

std::uint64_t held_bytes(const ProgressiveMesh& mesh) {
  std::uint64_t sum = 0;
  for (const auto& [cell, segment] : terrain().segments()) {
    if (mesh.holds(cell, segment)) sum += terrain().segment(cell, segment).size();
  }
  return sum;
}

// The mesh is what its segments and targets mean, whatever it has been through.
void expect_as_gone_straight(const ViewModel& model) {
  ASSERT_TRUE(testing::is_largest_mesh(model.mesh()));
  ProgressiveMesh straight(terrain().head, MeshMemory::live_part);
  straight.set_index(terrain().index);
  std::vector<CellTarget> targets;
  for (const auto& [cell, segment] : terrain().segments()) {
    if (model.mesh().holds(cell, segment)) {
      ASSERT_TRUE(straight.add_segment(cell, segment, terrain().segment(cell, segment)));
    }
  }
  for (std::uint32_t c = 0; c < terrain().index->cells.size(); ++c) targets.push_back({c, model.mesh().target(c)});
  (void)straight.move_to(targets);
  ASSERT_TRUE(testing::refined_image_of(model.mesh()) == testing::refined_image_of(straight));
}

TEST(ViewModel, RefinesToTheToleranceAndThenAsksForNothingMore) {
  for (const double tolerance_px : {8.0, 2.0, 0.5}) {
    SCOPED_TRACE(tolerance_px);
    const auto model = new_model();
    PlanOptions options;
    options.tolerance_px = tolerance_px;
    const View view = view_at(0.3);
    const double at_first = model->plan(view, options).stated_error_px;
    ASSERT_TRUE(settle(*model, view, options));
    const std::uint32_t vertices = model->mesh().vertex_count();
    EXPECT_LE(model->current_plan().stated_error_px, tolerance_px);
    EXPECT_GT(at_first, tolerance_px);
    EXPECT_LT(vertices, terrain().head->vertex_count) << "what is outside of the picture is not wanted";
    EXPECT_EQ(model->current_plan().limitation, Limitation::none);
    for (int frame = 0; frame < 3; ++frame) {
      const Plan& plan = model->plan(view, options);
      EXPECT_TRUE(plan.settled);
      EXPECT_TRUE(plan.wants.empty());
      const MeshMove move = model->apply();
      EXPECT_EQ(move.applied + move.undone, 0U);
      EXPECT_TRUE(model->evict().empty());
    }
    expect_as_gone_straight(*model);
  }
}

// But for a little where what a cell has come to cover turns out to lie nearer.
TEST(ViewModel, TheStatedErrorFallsWhileWantsComeInTheirOrder) {
  const auto model = new_model();
  const PlanOptions options;
  const View view = view_at(1.1);
  double stated = model->plan(view, options).stated_error_px;
  std::uint64_t applied = 0;
  for (int list = 0; list < 200 && !model->current_plan().wants.empty(); ++list) {
    const std::vector<Want> wants = model->current_plan().wants;
    const double before = stated;
    for (const Want& want : wants) {
      add_want(*model, want);
      const MeshMove move = model->apply();
      applied += move.applied - move.undone;
      const Plan& plan = model->plan(view, options);
      ASSERT_LE(plan.stated_error_px, 1.05 * stated) << "list " << list << ", cell " << want.cell;
      stated = plan.stated_error_px;
      ASSERT_EQ(plan.memory_bytes,
                held_bytes(model->mesh()) + static_cast<std::uint64_t>(std::llround(
                                                options.bytes_per_triangle * static_cast<double>(plan.triangles))));
    }
    ASSERT_LE(stated, before) << "list " << list;
  }
  EXPECT_TRUE(model->current_plan().settled);
  EXPECT_LE(stated, options.tolerance_px);
  EXPECT_EQ(model->mesh().vertex_count(), terrain().head->base.places.size() + applied);
}

TEST(ViewModel, AMemoryBudgetIsKeptWhereverTheCameraGoes) {
  const auto free = new_model();
  PlanOptions options;
  options.bytes_per_triangle = 4.0;  // so that segments count
  for (int i = 0; i < 6; ++i) ASSERT_TRUE(settle(*free, view_at(i), options));
  const std::uint64_t unlimited = free->plan(view_at(5), options).memory_bytes;
  const auto model = new_model();
  const std::uint64_t base = model->plan(view_at(0), options).memory_bytes;
  options.max_memory_bytes = base + (unlimited - base) / 3;
  std::uint64_t evictions = 0;
  std::uint64_t most_bytes = 0;
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE("view " + std::to_string(i));
    const View view = view_at(0.9 * i, 0.3 + 0.1 * (i % 3));
    for (int round = 0; round < 200; ++round) {
      const Plan plan = model->plan(view, options);
      if (plan.settled) break;
      for (const Want& want : plan.wants) add_want(*model, want);
      (void)model->apply();
      (void)model->plan(view, options);
      evictions += model->evict().size();
    }
    const Plan& plan = model->plan(view, options);
    ASSERT_TRUE(plan.settled);
    const std::uint64_t triangles = model->mesh().triangle_mesh().triangles.size();
    const std::uint64_t memory_bytes = held_bytes(model->mesh()) + 4 * triangles;
    most_bytes = std::max(most_bytes, memory_bytes);
    // Triangles of a cell's segments are shared out by bytes, which is an estimate.
    EXPECT_LE(memory_bytes, options.max_memory_bytes + options.max_memory_bytes / 5);
    EXPECT_LE(plan.memory_bytes, options.max_memory_bytes);
    EXPECT_EQ(plan.limitation == Limitation::none, plan.effective_tolerance_px == options.tolerance_px);
    EXPECT_LE(plan.stated_error_px, plan.effective_tolerance_px);
    expect_as_gone_straight(*model);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(evictions, 0U);
  EXPECT_GT(2 * most_bytes, options.max_memory_bytes) << "and it is used";
}

TEST(ViewModel, WalkingAboutAndComingBackGivesAMeshOfItsSegmentsAndTargets) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const auto model = new_model();
    PlanOptions options;
    const View home = view_at(0.0);
    for (int i = 0; i < 8; ++i) {
      const View view = view_at(6.0 * random.unit(), 0.1 + random.unit());
      options.tolerance_px = 0.5 + 4.0 * random.unit();
      for (std::uint32_t round = random.below(5); round > 0; --round) {
        const Plan plan = model->plan(view, options);
        for (const Want& want : plan.wants) {
          if (!random.one_in(3)) add_want(*model, want);
        }
        (void)model->apply(random.one_in(2) ? 1 + random.below(500) : ProgressiveMesh::kNoBudget);
        if (random.one_in(2)) (void)model->evict();
      }
    }
    options.tolerance_px = 1.0;
    ASSERT_TRUE(settle(*model, home, options));
    EXPECT_LE(model->current_plan().stated_error_px, 1.0);
    expect_as_gone_straight(*model);
    if (HasFatalFailure()) return;
  }
}

TEST(ViewModel, AnIndexWhoseBoundsRiseIsRefusedByName) {
  auto index = std::make_shared<AssetIndex>(*terrain().index);
  index->segments.front().error_code = 3;
  index->segments.back().error_code = 200;
  ViewModel model(terrain().head);
  const Result<void> set = model.set_index(index, "the index");
  ASSERT_FALSE(set);
  EXPECT_EQ(set.error().kind, ErrorKind::bad_input);
  EXPECT_TRUE(set.error().message.starts_with("the index: ")) << set.error().message;
  EXPECT_FALSE(model.has_index());
}

}  // namespace
}  // namespace fanstream
