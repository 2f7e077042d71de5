// From a view to what a client should apply, fetch and forget. SCHEDULING.md explains the algorithm.
//
//   Planner planner(table);                              // the table is the caller's and outlives the planner
//   const Plan& plan = planner.plan(view, options);
//   ... refine and coarsen towards plan.targets, with what is held;
//   ... ask for plan.wants in that order; drop what plan.evictions say; tell the table; plan again.
//
// A plan is a pure function of table, view and options, but for one thing: while view and options stay the same, the
// budgets' threshold never falls again, unless bounds of cells become known that were not. So a still camera comes to
// rest: once the targets are applied, the next plan asks for nothing.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "client/view/cell_table.h"
#include "client/view/criteria.h"

namespace fanstream {

struct PlanOptions {
  Criteria criteria;
  // Refine where weighted_px is above this. 0: everything that has a weight and an error.
  double tolerance_px = 1.0;
  // What is applied is coarsened only where weighted_px at the coarser level is at most tolerance_px * coarsen_ratio. 0
  // to 1. At least as strong as the largest ratio of weights that a cell should be able to flip between (a silhouette
  // of weight 2: 0.5).
  double coarsen_ratio = 0.5;
  // The same for a cell that has a budget's threshold to meet: low ones calm a moving camera, high ones use the budget
  // best.
  double budget_coarsen_ratio = 0.8;

  // Budgets of the whole mesh, FM0 included. Memory is FM0's bytes + triangles * bytes_per_triangle + held segments.
  std::uint64_t max_triangles = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t max_memory_bytes = std::numeric_limits<std::uint64_t>::max();
  double bytes_per_triangle = 160.0;

  // Plan into cells that do not exist yet, as if they lay anywhere in their parents, so that no round trip is lost
  // where a slab ends. Their weighted_px counts this much when wants are ordered, 0 to 1.
  bool speculate = true;
  double speculation_weight = 0.5;
  // Wants are ordered by octaves of weighted_px relative to the tolerance, this many to a band (0: no bands), and by
  // utility per byte within a band. Bands bring the stated error down first, utility the picture as a whole.
  double band_octaves = 1.0;
  std::uint32_t max_wants = 16384;  // the rest comes with later plans
  friend bool operator==(const PlanOptions&, const PlanOptions&) = default;
};

// Fails (usage) where a number is not finite or out of its range.
Result<void> check_options(const PlanOptions& options);

struct Want {
  std::uint32_t cell = 0;
  std::uint32_t prefix = 0;  // hold segments 0 .. prefix-1
  float utility = 0.0F;      // weighted px * px of area per byte, what it forces counted in
  bool speculative = false;  // of a cell that does not exist yet
};

struct Eviction {
  std::uint32_t cell = 0;
  std::uint32_t keep_prefix = 0;  // drop held segments from this one on; never below the cell's target
};

enum class Limitation : std::uint8_t {
  none,
  bad_view,         // or bad options: nothing is wanted, everything stays as it is
  triangle_budget,  // the tolerance had to rise
  memory_budget,
  base_over_budget,  // FM0 alone is beyond a budget: nothing but FM0 is planned
};

struct Plan {
  // By cell, of cells yet to come too: the prefix that the mesh may refine it to. The last of it may be there only
  // because a cell beside needs a generation of it, and then will not be applied as a whole.
  std::vector<std::uint8_t> targets;
  std::vector<Want> wants;          // what a want needs of coarser layers always stands before it
  std::vector<Eviction> evictions;  // after the targets are applied; least valuable first

  Limitation limitation = Limitation::none;
  std::string reason;                   // one sentence if limitation is not none
  double effective_tolerance_px = 0.0;  // tolerance_px, or what the budgets make of it
  // At most so many pixels is what can be seen off, now and when the targets are applied; infinite if not known.
  double stated_error_px = 0.0;
  double planned_error_px = 0.0;
  // The same for entirely back-facing cells inside the frustum: how far they might stick out behind a silhouette.
  double hidden_error_px = 0.0;
  double planned_hidden_error_px = 0.0;
  // Of the whole mesh with FM0: now, and when all is fetched, applied and evicted.
  std::uint64_t triangles = 0;
  std::uint64_t planned_triangles = 0;
  std::uint64_t memory_bytes = 0;
  std::uint64_t planned_memory_bytes = 0;
  std::uint64_t missing_bytes = 0;     // of segments in the targets that are not held
  std::uint32_t missing_segments = 0;  // `wants` lists max_wants of them at most

  // Nothing to fetch, to apply, to coarsen or to evict.
  bool settled = false;
};

// No I/O, threads or clocks. Not thread safe; distinct planners are independent.
class Planner {
 public:
  explicit Planner(const CellTable& table);
  ~Planner();
  Planner(const Planner&) = delete;
  Planner& operator=(const Planner&) = delete;

  // Valid until the next call. Never fails: see Limitation. Costs nothing if neither table, view nor options changed
  // since the last call.
  const Plan& plan(const View& view, const PlanOptions& options);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace fanstream
