// Single cases of the planner: bad input, budgets below the base mesh, hysteresis, speculation.
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "client/view/planner.h"
#include "tests/unit/client/view/cell_world.h"

namespace fanstream {
namespace {

using testing::CellWorld;
using testing::CellWorldShape;
using testing::SeededRandom;

CellWorld middling_world(std::uint64_t seed = 1) {
  SeededRandom random(seed);
  CellWorldShape shape;
  shape.roots = 8;
  shape.slabs = 4;
  shape.fixed_layers = true;
  return {shape, random};
}

// Its finest cells are a fortieth of the globe wide.
CellWorld fine_world() {
  SeededRandom random(2);
  CellWorldShape shape;
  shape.roots = 50;
  shape.slabs = 4;
  shape.fixed_layers = true;
  CellWorld world(shape, random);
  world.reveal_everything();
  return world;
}

View side_view(double angle = 0.0, double distance = 3.6) {
  View view;
  view.camera.eye = distance * glm::dvec3(std::sin(angle), 0.0, std::cos(angle));
  return view;
}

// Plans, fetches and applies until nothing is left to do.
const Plan& settle(CellWorld& world, Planner& planner, const View& view, const PlanOptions& options) {
  SeededRandom random(1);
  for (int round = 0; round < 1000; ++round) {
    const Plan& plan = planner.plan(view, options);
    if (plan.settled) break;
    for (const Want& want : plan.wants) world.table().set_held(want.cell, want.prefix);
    const std::vector<Eviction> evictions = plan.evictions;
    world.move_to(std::vector<std::uint8_t>(plan.targets), random);
    world.evict(evictions);
  }
  EXPECT_TRUE(planner.plan(view, options).settled);
  return planner.plan(view, options);
}

std::vector<std::uint8_t> applied(const CellWorld& world) {
  std::vector<std::uint8_t> all;
  for (std::uint32_t c = 0; c < world.table().cell_count(); ++c)
    all.push_back(static_cast<std::uint8_t>(world.table().applied(c)));
  return all;
}

TEST(Planner, BadViewsAndOptionsHoldWhatThereIsAndSayWhy) {
  CellWorld world = middling_world();
  Planner planner(world.table());
  settle(world, planner, side_view(), {});
  ASSERT_GT(world.table().begun_triangles(), 0U);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::function<void(View&, PlanOptions&)>> spoil = {
      [&](View& v, PlanOptions&) { v.camera.eye.z = nan; },
      [](View& v, PlanOptions&) { v.camera.eye.z = INFINITY; },
      [](View& v, PlanOptions&) { v.camera.target = v.camera.eye; },
      [](View& v, PlanOptions&) { v.width_px = 0; },
      [](View& v, PlanOptions&) { v.height_px = 0; },
      [](View&, PlanOptions& o) { o.tolerance_px = -1.0; },
      [&](View&, PlanOptions& o) { o.tolerance_px = nan; },
      [](View&, PlanOptions& o) { o.tolerance_px = INFINITY; },
      [](View&, PlanOptions& o) { o.coarsen_ratio = 1.5; },
      [](View&, PlanOptions& o) { o.budget_coarsen_ratio = 0.0; },
      [&](View&, PlanOptions& o) { o.bytes_per_triangle = nan; },
      [](View&, PlanOptions& o) { o.bytes_per_triangle = -1; },
      [&](View&, PlanOptions& o) { o.criteria.silhouette_weight = nan; }};
  for (std::size_t i = 0; i < spoil.size(); ++i) {
    SCOPED_TRACE(i);
    View view = side_view();
    PlanOptions options;
    spoil[i](view, options);
    const Plan& plan = planner.plan(view, options);
    EXPECT_EQ(plan.limitation, Limitation::bad_view);
    EXPECT_FALSE(plan.reason.empty());
    EXPECT_EQ(plan.targets, applied(world));
    EXPECT_TRUE(plan.wants.empty());
    EXPECT_TRUE(plan.evictions.empty());
    EXPECT_FALSE(plan.settled);
    EXPECT_EQ(plan.stated_error_px, INFINITY) << "nothing is promised";
    const Plan& recovered = planner.plan(side_view(), {});
    EXPECT_EQ(recovered.limitation, Limitation::none);
    EXPECT_TRUE(recovered.settled);
  }
}

TEST(Planner, ExtremeButValidViewsGiveFinitePlans) {
  CellWorld world = middling_world();
  const std::vector<View> views = {{{{0, 0, 0}, {0, 0, 1}}, 1024, 768, 0.0},      // inside the model
                                   {{{0, 0, 1}, {0, 0, 0}}, 1024, 768, 1e-300},   // on the surface
                                   {{{0, 0, 1e100}, {0, 0, 0}}, 1024, 768, 0.0},  // nearly at infinity
                                   {{{0, 0, 1}, {0, 0, 1 - 1e-12}}, 1, 1, 0.0},   // one pixel, a tiny step ahead
                                   {{{0, 0, 3}, {0, 0, 0}, {0, 1, 0}, 170}, 65536, 1, 0.0},  // nearly flat
                                   {{{0, 0, 3}, {0, 0, 9}}, 1024, 768, 0.0}};                // looking away
  for (std::size_t i = 0; i < views.size(); ++i) {
    SCOPED_TRACE(i);
    ASSERT_TRUE(check_view(views[i]));
    Planner planner(world.table());
    const Plan& plan = settle(world, planner, views[i], {});
    EXPECT_TRUE(std::isfinite(plan.stated_error_px));
    EXPECT_EQ(plan.limitation, Limitation::none) << plan.reason;
  }
  EXPECT_EQ(Planner(world.table()).plan(views[5], {}).stated_error_px, 0.0) << "nothing is in view";
  Planner planner(world.table());
  EXPECT_LT(settle(world, planner, views[2], {}).stated_error_px, 1e-90);
  EXPECT_EQ(world.table().begun_triangles(), 0U) << "nothing is needed so far away";
}

TEST(Planner, ToleranceZeroWantsAllThatHasAnError) {
  CellWorld world = middling_world();
  Planner planner(world.table());
  PlanOptions options;
  options.tolerance_px = 0.0;
  options.criteria.use_frustum = false;
  const Plan& plan = settle(world, planner, side_view(), options);
  EXPECT_EQ(plan.stated_error_px, 0.0);
  EXPECT_EQ(plan.hidden_error_px, 0.0);
  for (std::uint32_t c = 0; c < world.table().cell_count(); ++c)
    ASSERT_EQ(world.table().applied(c), world.table().segment_count(c));
}

TEST(Planner, BudgetsBelowTheBaseMeshLeaveTheBaseMesh) {
  for (const bool memory : {false, true}) {
    CellWorld world = middling_world();
    Planner planner(world.table());
    PlanOptions options;
    settle(world, planner, side_view(), options);
    ASSERT_GT(world.table().held_bytes(), 0U);
    (memory ? options.max_memory_bytes : options.max_triangles) = 10;
    const Plan& plan = settle(world, planner, side_view(), options);
    EXPECT_EQ(plan.limitation, Limitation::base_over_budget);
    EXPECT_NE(plan.reason.find("100 triangles"), std::string::npos) << plan.reason;
    EXPECT_EQ(plan.triangles, 100U);
    EXPECT_TRUE(plan.wants.empty());
    EXPECT_EQ(world.table().held_bytes() == 0, memory) << "memory is freed if that is what lacks";
    EXPECT_GT(plan.stated_error_px, options.tolerance_px);
  }
}

TEST(Planner, AnEmptyTableHasAnEmptyPlan) {
  const CellTable table;
  Planner planner(table);
  const Plan& plan = planner.plan(side_view(), {});
  EXPECT_TRUE(plan.settled);
  EXPECT_TRUE(plan.targets.empty());
  EXPECT_EQ(plan.stated_error_px, 0.0);
  PlanOptions options;
  options.max_triangles = 0;
  EXPECT_TRUE(planner.plan(side_view(), options).settled);
}

TEST(Planner, CellsWithoutBoundsMayBeAnywhere) {
  const SlabShape slabs[] = {{1, 1}, {2, 1}};
  const std::uint32_t children[] = {2};
  CellTable table = *CellTable::create(slabs, children);
  table.set_segment(0, 0, {0.1F, 10, 10});
  table.set_segment(1, 0, {0.05F, 10, 10});
  table.set_segment(2, 0, {0.01F, 10, 10});
  Planner planner(table);
  const View view = side_view();
  const double before = planner.plan(view, {}).stated_error_px;
  EXPECT_GT(before, 1000.0) << "a tenth of the model right before the eye";
  EXPECT_EQ(planner.plan(view, {}).wants.size(), 3U);
  table.set_extent(0, {{0, 0, 0}, 1.0});
  const double after = planner.plan(view, {}).stated_error_px;
  EXPECT_LT(after, 100.0);
  EXPECT_GT(after, 0.1 / 3.6 * 1000);
}

TEST(Planner, CoarsensOnlyWellBelowTheTolerance) {
  CellWorld world = middling_world();
  world.reveal_everything();
  Planner planner(world.table());
  PlanOptions options;
  options.tolerance_px = 2.0;
  settle(world, planner, side_view(), options);
  options.tolerance_px = 3.9;
  EXPECT_TRUE(planner.plan(side_view(), options).settled);
  options.tolerance_px = 8.0;
  const Plan& coarser = planner.plan(side_view(), options);
  EXPECT_LT(coarser.planned_triangles, coarser.triangles);
  EXPECT_TRUE(coarser.wants.empty());
  EXPECT_TRUE(coarser.evictions.empty()) << "what is held stays while there is room";
}

TEST(Planner, ATremblingCameraChangesNothingTwice) {
  // Once every view of the trembling has had what it wants, nothing is undone or applied any more.
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    CellWorld world = middling_world(seed);
    Planner planner(world.table());
    const auto trembling = [](std::uint32_t i) { return side_view(0.5 + 0.002 * ((i * 7) % 5)); };
    for (std::uint32_t i = 0; i < 10; ++i) settle(world, planner, trembling(i), {});
    ASSERT_GT(world.table().begun_triangles(), 1000U);
    for (std::uint32_t i = 0; i < 10; ++i) EXPECT_TRUE(planner.plan(trembling(i), {}).settled) << "view " << i;
  }
}

TEST(Planner, NothingChangedGivesTheSamePlan) {
  CellWorld world = middling_world();
  Planner planner(world.table());
  const Plan* plan = &planner.plan(side_view(), {});
  const Want* wants = plan->wants.data();
  EXPECT_EQ(planner.plan(side_view(), {}).wants.data(), wants);
  const std::size_t before = plan->wants.size();
  world.table().set_held(plan->wants[0].cell, plan->wants[0].prefix);
  EXPECT_LT(planner.plan(side_view(), {}).wants.size(), before);
}

TEST(Planner, FirstPlanReachesIntoSlabsThatDoNotExistYet) {
  CellWorld world = middling_world();
  Planner planner(world.table());
  PlanOptions options;
  const Plan with = planner.plan(side_view(), options);
  options.speculate = false;
  const Plan without = planner.plan(side_view(), options);
  EXPECT_GT(with.wants.size(), 2 * without.wants.size());
  for (const Want& want : without.wants) EXPECT_EQ(world.table().slab_of(want.cell), 0U);
  std::uint32_t speculative = 0;
  for (const Want& want : with.wants) {
    EXPECT_EQ(want.speculative, world.table().slab_of(want.cell) > 0);
    speculative += want.speculative;
  }
  EXPECT_GT(speculative, 0U);
  // Without, each slab costs a round of its own; in the end both have what the view needs.
  CellWorld other = middling_world();
  options.speculate = false;
  Planner slow(other.table());
  const Plan& last = settle(other, slow, side_view(), options);
  EXPECT_LE(last.stated_error_px, 1.0);
  EXPECT_LE(settle(world, planner, side_view(), {}).stated_error_px, 1.0);
}

TEST(Planner, WhatIsFarOutOfViewIsNotWantedUnlessForced) {
  const CellWorld world = fine_world();
  View close = side_view(0.0, 1.3);
  close.camera.fov_deg = 20.0;
  PlanOptions options;
  const Plan narrow = Planner(world.table()).plan(close, options);
  options.criteria.offscreen_weight = 1.0;
  const Plan all = Planner(world.table()).plan(close, options);
  EXPECT_LT(2 * narrow.missing_bytes, all.missing_bytes);
  EXPECT_LE(narrow.planned_error_px, 1.0);
  EXPECT_LE(all.planned_error_px, 1.0);
}

TEST(Planner, SilhouettesGetMoreThanFrontFaces) {
  const CellWorld world = fine_world();
  PlanOptions options;
  options.tolerance_px = 8.0;
  options.criteria.silhouette_weight = 1.0;
  const Plan even = Planner(world.table()).plan(side_view(), options);
  options.criteria.silhouette_weight = 2.0;
  const Plan finer = Planner(world.table()).plan(side_view(), options);
  const ViewJudge judge(side_view(), options.criteria);
  std::uint64_t near_silhouette = 0, elsewhere = 0;
  for (std::uint32_t c = 0; c < world.table().cell_count(); ++c) {
    ASSERT_GE(finer.targets[c], even.targets[c]);
    const std::uint32_t more = finer.targets[c] - even.targets[c];
    const double weight = judge.judge(world.table().extent(c), world.table().error_at(c, 0)).weight;
    (weight > 1.0 ? near_silhouette : elsewhere) += more;
  }
  EXPECT_GT(near_silhouette, 100U);
  EXPECT_GT(near_silhouette, 2 * elsewhere) << "elsewhere only what they force beside them";
  EXPECT_LE(finer.planned_error_px, even.planned_error_px);
}

TEST(Planner, BudgetOfAStillCameraNeverOscillates) {
  // Cells turn up beside others as the mesh is refined, so what a tolerance costs is known only bit by bit.
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    CellWorld world = middling_world(seed);
    Planner planner(world.table());
    PlanOptions options;
    options.tolerance_px = 0.1;
    options.max_triangles = 2000 + 500 * seed;
    SeededRandom random(seed);
    const Plan& plan = settle(world, planner, side_view(), options);
    EXPECT_EQ(plan.limitation, Limitation::triangle_budget);
    EXPECT_LE(plan.triangles, options.max_triangles);
    EXPECT_GT(plan.triangles, options.max_triangles / 2) << "the budget is used";
    EXPECT_GT(plan.effective_tolerance_px, 0.1);
  }
}

TEST(Planner, BudgetIsUsedOnceItIsKnownWhereCellsAre) {
  // At first all cells count as being as near as their parents, and the budget seems to buy little.
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    CellWorld world = middling_world(seed);
    Planner planner(world.table());
    PlanOptions options;
    options.tolerance_px = 0.1;
    options.max_triangles = 2000 + 500 * seed;
    const Plan& rest = settle(world, planner, side_view(), options);
    Planner fresh(world.table());
    EXPECT_GE(1.05 * rest.triangles, fresh.plan(side_view(), options).planned_triangles);
  }
}

TEST(Planner, CutOfAStillCameraFallsOnlyWhenCellsTurnOutToBeElsewhere) {
  const SlabShape slab{2, 1};
  CellTable table = *CellTable::create({&slab, 1}, {});
  for (std::uint32_t c = 0; c < 2; ++c) table.set_segment(c, 0, {0.1F, 10, 100});
  PlanOptions options;
  options.max_triangles = 100;
  Planner planner(table);
  EXPECT_EQ(planner.plan(side_view(), options).planned_triangles, 0U) << "both may be anywhere, and only one fits";
  table.set_extent(0, {{0, 0, 0}, 0.1});
  table.set_extent(1, {{0, 0, -5}, 0.1});
  const double tolerance_px = planner.plan(side_view(), options).effective_tolerance_px;
  EXPECT_EQ(planner.plan(side_view(), options).targets, (std::vector<std::uint8_t>{1, 0}));
  table.set_segment(1, 0, {0.1F, 10, 0});
  EXPECT_EQ(planner.plan(side_view(), options).targets, (std::vector<std::uint8_t>{1, 0})) << "nothing swings back";
  EXPECT_EQ(planner.plan(side_view(), options).effective_tolerance_px, tolerance_px);
  EXPECT_EQ(planner.plan(side_view(0.01), options).targets, (std::vector<std::uint8_t>{1, 1})) << "the camera moved";
}

TEST(Planner, ParentsAreNotEvictedUnderTheirChildren) {
  const SlabShape slabs[] = {{1, 1}, {1, 1}};
  const std::uint32_t children[] = {1};
  CellTable table = *CellTable::create(slabs, children);
  for (std::uint32_t c = 0; c < 2; ++c) {
    table.set_segment(c, 0, {0.1F, 1000, 0});
    table.set_held(c, 1);
  }
  table.set_extent(0, {{0, 0, 1e6}, 1.0});  // out of sight, so that by itself it is worth less than its child
  table.set_extent(1, {{0, 0, 0}, 0.1});
  PlanOptions options;
  options.tolerance_px = 1e6;
  options.max_memory_bytes = 1500;
  Planner planner(table);
  const Plan& plan = planner.plan(side_view(), options);
  ASSERT_EQ(plan.evictions.size(), 2U) << "both are of equal worth";
  options.max_memory_bytes = 999;
  EXPECT_EQ(planner.plan(side_view(), options).evictions.size(), 2U);
  table.set_segment(1, 0, {0.05F, 1000, 0});
  table.set_extent(0, {{0, 0, 0}, 0.1});
  options.max_memory_bytes = 1500;
  const Plan& one = planner.plan(side_view(), options);
  ASSERT_EQ(one.evictions.size(), 1U);
  EXPECT_EQ(one.evictions[0].cell, 1U);
}

}  // namespace
}  // namespace fanstream
