// How long a plan takes: cells in 5 slabs of 8 layers each, about 6 neighbours a cell, the model filling a picture of
// 1024 x 768. Tolerances are in hundredths of a pixel: at 25 most cells of the finest slab are refined. Example:
// fanstream-bench-planner --benchmark_filter=CameraMove
#include <benchmark/benchmark.h>

#include <map>
#include <memory>

#include "tests/unit/client/view/cell_world.h"

namespace fanstream {
namespace {

using testing::CellWorld;
using testing::CellWorldShape;
using testing::SeededRandom;

View orbit(double angle) {
  View view;
  view.camera.eye = 3.6 * glm::dvec3(std::sin(angle), 0.2, std::cos(angle));
  return view;
}

PlanOptions options_for(std::int64_t tolerance) {
  PlanOptions options;
  options.tolerance_px = 0.01 * static_cast<double>(tolerance);
  return options;
}

CellWorldShape shape_of(std::int64_t cells) {
  CellWorldShape shape;
  shape.roots = static_cast<std::uint32_t>(cells / 121);
  shape.slabs = 5;
  shape.most_layers = 8;
  shape.fixed_layers = true;
  shape.decay = 0.84;
  return shape;
}

// Dependencies are at least as many as in a real asset. Counted on the large dragon of the Stanford repository (11,219
// cells, the finest slab of 6 generations) after live views of it as a whole from nine sides, at 0.25 px and at 1 px: a
// live cell knows of 7.9 and 7.7 needs, 1.3 a generation, and of 1.5 supports for each generation that is applied, 15.5
// and 9.1 of both together. So here each cell has, of what it would need if it waited for all cells beside it in every
// generation (6 to 7 a generation), a random quarter as needs, and another as what it lies on: 1.7 a generation, and of
// all cells, not only of live ones.
std::vector<Dependency> random_quarter(const CellWorld& world, std::uint32_t cell, SeededRandom& random) {
  std::vector<Dependency> list = testing::needs_beside(world.table(), cell, world.beside(cell));
  std::erase_if(list, [&](const Dependency&) { return !random.one_in(4); });
  return list;
}

// With everything known that can be known of the cells, and the plan for orbit(0) applied and held.
std::unique_ptr<CellWorld> settled_world(std::int64_t cells, std::int64_t tolerance) {
  SeededRandom random(7);
  auto world = std::make_unique<CellWorld>(shape_of(cells), random);
  CellTable& table = world->table();
  world->reveal_extents();
  std::vector<std::vector<Dependency>> lies_on;
  for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
    table.add_needs(c, random_quarter(*world, c, random));
    lies_on.push_back(random_quarter(*world, c, random));
  }
  Planner planner(table);
  for (const Plan* plan = nullptr; plan == nullptr || !plan->settled;) {
    plan = &planner.plan(orbit(0.0), options_for(tolerance));
    for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
      table.set_held(c, plan->targets[c]);
      table.set_applied(c, plan->targets[c]);
      std::vector<Dependency> supports = lies_on[c];
      std::erase_if(supports, [&](const Dependency& d) { return table.step_of(c, d.generation) > plan->targets[c]; });
      table.set_supports(c, supports);
    }
  }
  return world;
}

CellWorld& shared_world(std::int64_t cells, std::int64_t tolerance) {
  static std::map<std::pair<std::int64_t, std::int64_t>, std::unique_ptr<CellWorld>> worlds;
  auto& world = worlds[{cells, tolerance}];
  if (!world) world = settled_world(cells, tolerance);
  return *world;
}

void report(benchmark::State& state, const CellTable& table, const Plan& plan) {
  std::uint64_t applied = 0;
  std::uint64_t planned = 0;
  std::uint64_t dependencies = 0;
  for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
    applied += table.applied(c);
    planned += plan.targets[c];
    dependencies += table.needs(c).size() + table.supports(c).size();
  }
  state.counters["cells"] = table.cell_count();
  state.counters["applied"] = static_cast<double>(applied);
  state.counters["planned"] = static_cast<double>(planned);
  state.counters["dependencies"] = static_cast<double>(dependencies);
  state.counters["missing"] = plan.missing_segments;
}

// A full plan after the camera has gone around the model by some hundredths of a degree.
void CameraMove(benchmark::State& state) {
  CellWorld& world = shared_world(state.range(0), state.range(1));
  const PlanOptions options = options_for(state.range(1));
  Planner planner(world.table());
  double degrees = 0.01 * static_cast<double>(state.range(2));
  std::uint32_t turn = 0;
  const Plan* plan = nullptr;
  for (auto _ : state) {
    // Never the same view twice in a row.
    const double angle = (degrees + 1e-6 * (turn++ % 2)) * std::numbers::pi / 180.0;
    plan = &planner.plan(orbit(angle), options);
    benchmark::DoNotOptimize(plan->wants.data());
  }
  report(state, world.table(), *plan);
}
BENCHMARK(CameraMove)
    ->ArgNames({"cells", "tolerance", "degrees"})
    ->ArgsProduct({{10'043, 100'000}, {100, 25}, {100, 1000, 18'000}})
    ->Unit(benchmark::kMicrosecond);

// The same within a triangle budget of half of what the view would like.
void CameraMoveInBudget(benchmark::State& state) {
  CellWorld& world = shared_world(state.range(0), 25);
  PlanOptions options = options_for(25);
  Planner planner(world.table());
  options.max_triangles = planner.plan(orbit(0.0), options).planned_triangles / 2;
  std::uint32_t turn = 0;
  const Plan* plan = nullptr;
  for (auto _ : state) {
    plan = &planner.plan(orbit(0.01 + 1e-8 * (turn++ % 2)), options);
    benchmark::DoNotOptimize(plan->wants.data());
  }
  report(state, world.table(), *plan);
}
BENCHMARK(CameraMoveInBudget)->ArgName("cells")->Arg(10'043)->Arg(100'000)->Unit(benchmark::kMicrosecond);

// A segment has arrived, the camera stands still.
void SegmentArrived(benchmark::State& state) {
  CellWorld& world = shared_world(state.range(0), 25);
  const PlanOptions options = options_for(25);
  Planner planner(world.table());
  const std::uint32_t held = world.table().held(0);
  std::uint32_t turn = 0;
  const Plan* plan = nullptr;
  for (auto _ : state) {
    world.table().set_held(0, turn++ % 2 == 0 ? held - 1 : held);
    plan = &planner.plan(orbit(0.0), options);
    benchmark::DoNotOptimize(plan->wants.data());
  }
  world.table().set_held(0, held);
  report(state, world.table(), *plan);
}
BENCHMARK(SegmentArrived)->ArgName("cells")->Arg(10'043)->Arg(100'000)->Unit(benchmark::kMicrosecond);

// The mesh has changed everywhere, so that all dependencies of what is applied are new; the camera stands still.
void MeshChanged(benchmark::State& state) {
  const std::unique_ptr<CellWorld> world = settled_world(state.range(0), 25);
  CellTable& table = world->table();
  const PlanOptions options = options_for(25);
  Planner planner(table);
  std::vector<std::vector<Dependency>> supports;
  for (std::uint32_t c = 0; c < table.cell_count(); ++c)
    supports.emplace_back(table.supports(c).begin(), table.supports(c).end());
  bool last_left_out = false;
  const Plan* plan = nullptr;
  for (auto _ : state) {
    state.PauseTiming();
    last_left_out = !last_left_out;
    for (std::uint32_t c = 0; c < table.cell_count(); ++c)
      table.set_supports(c, std::span(supports[c]).first(supports[c].size() - (last_left_out && !supports[c].empty())));
    state.ResumeTiming();
    plan = &planner.plan(orbit(0.0), options);
    benchmark::DoNotOptimize(plan->wants.data());
  }
  report(state, table, *plan);
}
BENCHMARK(MeshChanged)->ArgName("cells")->Arg(10'043)->Arg(100'000)->Unit(benchmark::kMicrosecond);

// FM0 and the index have just come: nothing is known of the cells but what the index says.
void FirstPlan(benchmark::State& state) {
  SeededRandom random(7);
  const CellWorld world(shape_of(state.range(0)), random);
  Planner planner(world.table());
  std::uint32_t turn = 0;
  const Plan* plan = nullptr;
  for (auto _ : state) {
    plan = &planner.plan(orbit(1e-8 * (turn++ % 2)), options_for(100));
    benchmark::DoNotOptimize(plan->wants.data());
  }
  report(state, world.table(), *plan);
}
BENCHMARK(FirstPlan)->ArgName("cells")->Arg(10'043)->Arg(100'000)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace fanstream

BENCHMARK_MAIN();
