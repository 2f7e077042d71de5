// What every plan keeps to, on random models, views, options and states.
#include "client/view/planner.h"

#include <gtest/gtest.h>

#include "tests/unit/client/view/cell_world.h"

namespace fanstream {
namespace {

using testing::CellWorld;
using testing::CellWorldShape;
using testing::random_view;
using testing::SeededRandom;

CellWorldShape random_shape(SeededRandom& random) {
  CellWorldShape shape;
  shape.roots = 1 + random.below(12);
  shape.slabs = 1 + random.below(4);
  shape.least_children = random.below(3);
  shape.most_children = shape.least_children + 1 + random.below(3);
  shape.most_layers = 1 + random.below(4);
  shape.most_generations = random.one_in(2) ? 1 : 1 + random.below(4);
  return shape;
}

PlanOptions random_options(SeededRandom& random) {
  PlanOptions options;
  options.tolerance_px = random.one_in(10) ? 0.0 : std::pow(2.0, 8.0 * random.unit() - 2.0);
  options.coarsen_ratio = random.unit();
  options.budget_coarsen_ratio = 0.5 + 0.5 * random.unit();
  options.speculate = !random.one_in(3);
  options.speculation_weight = random.unit();
  options.band_octaves = random.one_in(3) ? 0.0 : 2.0 * random.unit();
  options.criteria.use_frustum = !random.one_in(4);
  options.criteria.offscreen_weight = random.one_in(2) ? 0.0 : random.unit();
  options.criteria.use_facing = !random.one_in(4);
  options.criteria.back_facing_weight = random.one_in(3) ? 0.0 : random.unit();
  options.criteria.silhouette_weight = 1.0 + 3.0 * random.unit();
  if (random.one_in(3)) options.criteria.focus_point = FocusPoint{{1, 0, 0}, random.unit(), 0.5, random.unit()};
  if (random.one_in(3)) options.criteria.focus_direction = FocusDirection{{1, 1, 0}, 20, 40, random.unit()};
  return options;
}

// A budget between FM0 and all that the plan would like.
void limit_at_random(PlanOptions& options, const CellWorld& world, const View& view, SeededRandom& random) {
  const Plan free = Planner(world.table()).plan(view, options);
  const auto between = [&](std::uint64_t low, std::uint64_t high) {
    return low + static_cast<std::uint64_t>(random.unit() * static_cast<double>(high - low));
  };
  const std::uint64_t base_triangles = world.table().base_triangles();
  if (random.one_in(2)) options.max_triangles = between(base_triangles, free.planned_triangles);
  if (!random.one_in(2)) return;
  const std::uint64_t base_memory = world.table().base_memory_bytes() + base_triangles * 160;
  options.max_memory_bytes = between(base_memory, std::max(base_memory, free.planned_memory_bytes));
}

// The client's part: some of the wants arrive, in order; then the mesh moves and memory is freed.
void follow(CellWorld& world, const Plan& plan, SeededRandom& random) {
  const std::size_t arrived = random.one_in(3) ? plan.wants.size() : random.below(plan.wants.size() + 1);
  for (std::size_t i = 0; i < arrived; ++i) world.table().set_held(plan.wants[i].cell, plan.wants[i].prefix);
  const std::vector<std::uint8_t> targets = plan.targets;
  const std::vector<Eviction> evictions = plan.evictions;
  world.move_to(targets, random);
  world.evict(evictions);
}

// Somewhere in the middle of things: a few plans for other views followed in part.
void wander(CellWorld& world, SeededRandom& random) {
  for (std::uint32_t i = random.below(4); i > 0; --i) {
    Planner planner(world.table());
    PlanOptions options = random_options(random);
    const View view = random_view(random);
    if (random.one_in(2)) limit_at_random(options, world, view, random);
    for (std::uint32_t steps = 1 + random.below(4); steps > 0; --steps)
      follow(world, planner.plan(view, options), random);
  }
}

class Situation {
 public:
  explicit Situation(std::uint64_t seed) : random_(seed), world_(random_shape(random_), random_) {
    if (random_.one_in(4)) world_.reveal_everything();
    wander(world_, random_);
    view_ = random_view(random_);
    options_ = random_options(random_);
  }
  void targets_are_closed();
  void wants_are_ordered();
  void targets_are_minimal();
  void comes_to_rest();
  void keeps_to_budgets();
  void predicts_sizes();
  void evictions_are_useless();
  void has_no_memory();

 private:
  const CellTable& table() const { return world_.table(); }
  std::uint64_t memory_of(const std::vector<std::uint8_t>& applied) const {
    double memory = static_cast<double>(table().base_memory_bytes()) +
                    static_cast<double>(table().base_triangles()) * options_.bytes_per_triangle;
    for (std::uint32_t c = 0; c < table().cell_count(); ++c) {
      for (std::uint32_t p = 1; p <= std::max<std::uint32_t>(table().held(c), applied[c]); ++p) {
        const std::uint32_t step = table().step_index(c, p);
        memory += table().sizes_bytes()[step];
        if (p <= applied[c]) memory += table().triangles()[step] * options_.bytes_per_triangle;
      }
    }
    return static_cast<std::uint64_t>(std::ceil(memory));
  }

  SeededRandom random_;
  CellWorld world_;
  View view_;
  PlanOptions options_;
};

void Situation::targets_are_closed() {
  if (random_.one_in(2)) limit_at_random(options_, world_, view_, random_);
  Planner planner(table());
  const Plan& plan = planner.plan(view_, options_);
  ASSERT_EQ(plan.targets.size(), table().cell_count());
  for (std::uint32_t c = 0; c < table().cell_count(); ++c) {
    ASSERT_LE(plan.targets[c], table().segment_count(c));
    for (std::uint32_t p = 1; p <= plan.targets[c]; ++p) {
      table().for_each_dependency(
          c, p, [&](std::uint32_t n, std::uint32_t q) { ASSERT_GE(plan.targets[n], q) << c << " needs " << n; });
    }
  }
}

void Situation::wants_are_ordered() {
  Planner planner(table());
  const Plan& plan = planner.plan(view_, options_);
  std::vector<std::uint32_t> held(table().cell_count());
  const auto fold = [&](std::uint32_t c) {
    while (held[c] < table().segment_count(c) && table().sizes_bytes()[table().step_index(c, held[c] + 1)] == 0)
      ++held[c];
  };
  for (std::uint32_t c = 0; c < held.size(); ++c) held[c] = table().held(c);
  std::uint64_t bytes = 0;
  for (const Want& want : plan.wants) {
    ASSERT_EQ(want.prefix, held[want.cell] + 1) << "cell " << want.cell;
    ASSERT_EQ(want.speculative, !world_.live(want.cell));
    table().for_each_dependency(want.cell, want.prefix, [&](std::uint32_t n, std::uint32_t q) {
      ASSERT_GE(held[n], q) << "cell " << want.cell << " at " << want.prefix << " needs cell " << n;
    });
    ++held[want.cell];
    fold(want.cell);
    bytes += table().sizes_bytes()[table().step_index(want.cell, want.prefix)];
  }
  for (std::uint32_t c = 0; c < held.size(); ++c) ASSERT_GE(held[c], plan.targets[c]);
  EXPECT_EQ(bytes, plan.missing_bytes);
  EXPECT_EQ(plan.wants.size(), plan.missing_segments);

  const std::vector<Want> all = plan.wants;
  options_.max_wants = static_cast<std::uint32_t>(all.size() / 2);
  const Plan& shorter = planner.plan(view_, options_);
  ASSERT_EQ(shorter.wants.size(), all.size() / 2);
  for (std::size_t i = 0; i < shorter.wants.size(); ++i) ASSERT_EQ(shorter.wants[i].cell, all[i].cell);
}

void Situation::targets_are_minimal() {
  options_.coarsen_ratio = 1.0;  // nothing is kept
  Planner planner(table());
  const Plan& plan = planner.plan(view_, options_);
  // Independently: each cell's own wish, then the rule until nothing changes.
  const ViewJudge judge(view_, options_.criteria);
  std::vector<CellJudgement> judgements(table().cell_count());
  std::vector<std::uint32_t> wished(table().cell_count());
  for (std::uint32_t c = 0; c < wished.size(); ++c) {
    const std::uint32_t parent = table().parent(c);
    if (table().extent_known(c)) {
      judgements[c] = judge.judge(table().extent(c), table().error_at(c, 0));
      if (parent != CellTable::kNoCell) narrow(judgements[c], judgements[parent]);
    } else {
      judgements[c] = judgements[parent];
      judgements[c].weight = judgements[c].weight_within;
    }
    if (!options_.speculate && !world_.live(c)) continue;
    for (std::uint32_t p = 1; p <= table().segment_count(c); ++p) {
      const double px = judgements[c].weight * judgements[c].error.px(table().error_at(c, p - 1));
      if (std::abs(px - options_.tolerance_px) < 1e-3 * px) return;  // too close to call in single precision
      if (px > options_.tolerance_px) wished[c] = p;
    }
  }
  // A wish is for whole segments, and so for all generations up to its last one.
  std::vector<std::uint32_t> needs(wished.size());
  bool changed = true;
  const auto need = [&](std::uint32_t c, std::uint32_t generation) {
    if (needs[c] >= generation) return;
    needs[c] = generation;
    changed = true;
  };
  for (std::uint32_t c = 0; c < wished.size(); ++c) {
    std::uint32_t generations = 0;
    for (std::uint32_t p = 1; p <= wished[c]; ++p) generations += table().layer_generations(table().slab_of(c), p - 1);
    need(c, generations);
  }
  while (changed) {
    changed = false;
    for (std::uint32_t c = 0; c < wished.size(); ++c) {
      if (needs[c] == 0) continue;
      const std::uint32_t parent = table().parent(c);
      if (parent != CellTable::kNoCell) need(parent, table().generations_of(table().slab_of(parent)));
      for (const Dependency& d : table().needs(c)) {
        if (d.generation <= needs[c]) need(d.cell, d.on);
      }
    }
  }
  for (std::uint32_t c = 0; c < wished.size(); ++c) wished[c] = needs[c] == 0 ? 0 : table().step_of(c, needs[c]);
  for (std::uint32_t c = 0; c < wished.size(); ++c) ASSERT_EQ(plan.targets[c], wished[c]) << "cell " << c;
}

void Situation::comes_to_rest() {
  if (random_.one_in(2)) limit_at_random(options_, world_, view_, random_);
  if (random_.one_in(3)) options_.max_wants = 1 + random_.below(20);
  Planner planner(table());
  int rounds = 0;
  for (; !planner.plan(view_, options_).settled; ++rounds) {
    ASSERT_LT(rounds, 2000);
    follow(world_, planner.plan(view_, options_), random_);
    ASSERT_TRUE(world_.legal());
  }
  const Plan plan = planner.plan(view_, options_);
  EXPECT_TRUE(plan.wants.empty());
  EXPECT_TRUE(plan.evictions.empty());
  for (std::uint32_t c = 0; c < table().cell_count(); ++c) ASSERT_EQ(plan.targets[c], table().begun(c));
  // Joined generations may reach further than was asked for.
  EXPECT_LE(plan.stated_error_px, plan.planned_error_px);
  if (!table().joins_generations()) {
    EXPECT_EQ(plan.stated_error_px, plan.planned_error_px);
  }
  EXPECT_EQ(plan.triangles, plan.planned_triangles);
  EXPECT_EQ(plan.memory_bytes, plan.planned_memory_bytes);
  EXPECT_LE(plan.triangles, options_.max_triangles);
  EXPECT_LE(plan.memory_bytes, options_.max_memory_bytes);
  // The same planner, made to look again.
  world_.table().set_base(table().base_triangles(), table().base_memory_bytes());
  EXPECT_TRUE(planner.plan(view_, options_).settled);
  // What can be seen and has full weight is within the tolerance.
  options_.criteria = {};
  options_.criteria.back_facing_weight = 1.0;
  Planner again(table());
  rounds = 0;
  for (; !again.plan(view_, options_).settled; ++rounds) {
    ASSERT_LT(rounds, 2000);
    follow(world_, again.plan(view_, options_), random_);
  }
  const Plan& full = again.plan(view_, options_);
  EXPECT_LE(full.stated_error_px, full.effective_tolerance_px * (1 + 1e-5));
  EXPECT_LE(full.hidden_error_px, full.effective_tolerance_px * (1 + 1e-5));
  EXPECT_EQ(full.effective_tolerance_px > options_.tolerance_px, full.limitation != Limitation::none) << full.reason;
}

void Situation::keeps_to_budgets() {
  PlanOptions options = options_;
  const Plan free = Planner(table()).plan(view_, options);
  for (const bool memory : {false, true}) {
    options = options_;
    Plan before;
    for (int i = 0; i <= 12; ++i) {
      const double share = i / 12.0;
      const std::uint64_t base = memory ? table().base_memory_bytes() + table().base_triangles() * 160 : 100;
      const std::uint64_t most = memory ? free.planned_memory_bytes : free.planned_triangles;
      const std::uint64_t budget = base + static_cast<std::uint64_t>(share * static_cast<double>(most - base));
      (memory ? options.max_memory_bytes : options.max_triangles) = budget;
      const Plan plan = Planner(table()).plan(view_, options);
      ASSERT_LE(memory ? plan.planned_memory_bytes : plan.planned_triangles, budget);
      if (plan.limitation != Limitation::none) {
        ASSERT_EQ(plan.limitation, memory ? Limitation::memory_budget : Limitation::triangle_budget);
        ASSERT_FALSE(plan.reason.empty());
        ASSERT_GT(plan.effective_tolerance_px, options.tolerance_px);
      }
      if (i > 0) {
        ASSERT_LE(plan.planned_error_px, before.planned_error_px);
        ASSERT_LE(plan.planned_hidden_error_px, std::max(before.planned_error_px, before.planned_hidden_error_px));
        ASSERT_LE(plan.effective_tolerance_px, before.effective_tolerance_px);
        for (std::uint32_t c = 0; c < table().cell_count(); ++c) ASSERT_GE(plan.targets[c], before.targets[c]);
      }
      before = plan;
    }
    EXPECT_EQ(before.targets, free.targets) << "with room for everything";
    EXPECT_EQ(before.limitation, Limitation::none);
  }
}

void Situation::predicts_sizes() {
  if (random_.one_in(2)) limit_at_random(options_, world_, view_, random_);
  Planner planner(table());
  const Plan plan = planner.plan(view_, options_);
  std::vector<std::uint8_t> applied(table().cell_count());
  for (std::uint32_t c = 0; c < applied.size(); ++c) applied[c] = static_cast<std::uint8_t>(table().begun(c));
  EXPECT_EQ(plan.memory_bytes, memory_of(applied));
  world_.evict(plan.evictions);
  EXPECT_EQ(plan.planned_memory_bytes, memory_of(plan.targets));
}

void Situation::evictions_are_useless() {
  for (std::uint32_t c = 0; c < table().cell_count(); ++c) world_.table().set_held(c, table().segment_count(c));
  Planner planner(table());
  const Plan roomy = planner.plan(view_, options_);
  ASSERT_TRUE(roomy.evictions.empty()) << "there is room";
  options_.max_memory_bytes = (roomy.planned_memory_bytes + table().base_memory_bytes() + 16000) / 2;
  const Plan plan = planner.plan(view_, options_);
  ASSERT_LE(plan.planned_memory_bytes, options_.max_memory_bytes);
  std::vector<std::uint32_t> held(table().cell_count());
  for (std::uint32_t c = 0; c < held.size(); ++c) held[c] = table().segment_count(c);
  for (const Eviction& eviction : plan.evictions) {
    ASSERT_LT(eviction.keep_prefix, held[eviction.cell]);
    ASSERT_GE(eviction.keep_prefix, plan.targets[eviction.cell]);
    held[eviction.cell] = eviction.keep_prefix;
  }
  for (std::uint32_t c = 0; c < held.size(); ++c) {
    const std::uint32_t parent = table().parent(c);
    if (parent == CellTable::kNoCell || held[c] == 0) continue;
    ASSERT_EQ(held[parent], table().segment_count(parent)) << "cell " << c << " is of no use without its parent";
  }
}

void expect_same(const Plan& a, const Plan& b) {
  ASSERT_EQ(a.targets, b.targets);
  ASSERT_EQ(a.wants.size(), b.wants.size());
  for (std::size_t i = 0; i < a.wants.size(); ++i) {
    ASSERT_EQ(a.wants[i].cell, b.wants[i].cell);
    ASSERT_EQ(a.wants[i].prefix, b.wants[i].prefix);
    ASSERT_EQ(a.wants[i].utility, b.wants[i].utility);
    ASSERT_EQ(a.wants[i].speculative, b.wants[i].speculative);
  }
  ASSERT_EQ(a.evictions.size(), b.evictions.size());
  for (std::size_t i = 0; i < a.evictions.size(); ++i) {
    ASSERT_EQ(a.evictions[i].cell, b.evictions[i].cell);
    ASSERT_EQ(a.evictions[i].keep_prefix, b.evictions[i].keep_prefix);
  }
  ASSERT_EQ(a.limitation, b.limitation);
  ASSERT_EQ(a.reason, b.reason);
  ASSERT_EQ(a.effective_tolerance_px, b.effective_tolerance_px);
  ASSERT_EQ(a.stated_error_px, b.stated_error_px);
  ASSERT_EQ(a.hidden_error_px, b.hidden_error_px);
  ASSERT_EQ(a.planned_error_px, b.planned_error_px);
  ASSERT_EQ(a.triangles, b.triangles);
  ASSERT_EQ(a.planned_triangles, b.planned_triangles);
  ASSERT_EQ(a.memory_bytes, b.memory_bytes);
  ASSERT_EQ(a.planned_memory_bytes, b.planned_memory_bytes);
  ASSERT_EQ(a.settled, b.settled);
}

void Situation::has_no_memory() {
  Planner old(table());
  for (int i = 0; i < 25; ++i) {
    SCOPED_TRACE("change " + std::to_string(i));
    if (random_.one_in(3)) {
      view_ = random_view(random_);
    } else if (random_.one_in(3)) {
      view_.camera.eye += 0.001 * random_.unit();
    } else if (random_.one_in(4)) {
      view_.width_px = 0;  // no view at all
    }
    if (random_.one_in(4)) options_ = random_options(random_);
    if (random_.one_in(4)) {
      limit_at_random(options_, world_, random_view(random_), random_);
      view_ = random_view(random_);
    } else if (options_.max_memory_bytes != PlanOptions{}.max_memory_bytes ||
               options_.max_triangles != PlanOptions{}.max_triangles) {
      view_ = random_view(random_);  // budgets of a still camera have a memory
    }
    const Plan& plan = old.plan(view_, options_);
    expect_same(plan, Planner(table()).plan(view_, options_));
    if (random_.one_in(2)) follow(world_, plan, random_);
    if (const std::uint32_t c = random_.below(table().cell_count()); random_.one_in(3) && table().extent_known(c)) {
      CellExtent extent = table().extent(c);
      extent.radius *= 0.5 + random_.unit();
      world_.table().set_extent(c, extent);
    }
  }
}

void in_every_situation(void (Situation::*check)()) {
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Situation situation(seed);
    (situation.*check)();
    if (::testing::Test::HasFatalFailure()) return;
  }
}

TEST(EveryPlan, HasTargetsThatAreClosedUnderTheRule) { in_every_situation(&Situation::targets_are_closed); }
TEST(EveryPlan, WantsWhatTheTargetsLackAndDependenciesFirst) { in_every_situation(&Situation::wants_are_ordered); }
TEST(EveryPlan, WantsExactlyWhatExceedsTheToleranceAndWhatThatForces) {
  in_every_situation(&Situation::targets_are_minimal);
}
TEST(EveryPlan, OfAStillCameraComesToRest) { in_every_situation(&Situation::comes_to_rest); }
TEST(EveryPlan, KeepsToItsBudgetsAndLargerOnesAreNeverWorse) { in_every_situation(&Situation::keeps_to_budgets); }
TEST(EveryPlan, PredictsTrianglesAndMemory) { in_every_situation(&Situation::predicts_sizes); }
TEST(EveryPlan, EvictsWhatTheTargetsDoNotNeedChildrenBeforeParents) {
  in_every_situation(&Situation::evictions_are_useless);
}
TEST(EveryPlan, IsTheSameFromAPlannerThatHasSeenMuchAndFromANewOne) { in_every_situation(&Situation::has_no_memory); }

}  // namespace
}  // namespace fanstream
