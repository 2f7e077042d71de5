#include "client/view/planner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "client/view/budget_cut.h"
#include "client/view/kept_judgements.h"
#include "client/view/step_thresholds.h"
#include "client/view/want_order.h"

namespace fanstream {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
// Segments out of sight are evicted by what they would show, seen at this weight at least.
constexpr double kLeastKeepWeight = 1.0 / 16;

bool within(double v, double low, double high) { return v >= low && v <= high; }

float to_float(double level) { return static_cast<float>(std::min(level, 1e30)); }

}  // namespace

Result<void> check_options(const PlanOptions& options) {
  if (Result<void> criteria = check_criteria(options.criteria); !criteria) return criteria;
  if (!(options.tolerance_px >= 0.0) || !std::isfinite(options.tolerance_px)) {
    return fail(ErrorKind::usage,
                fmt::format("tolerance: {} px; it must be finite and at least 0", options.tolerance_px));
  }
  if (!within(options.coarsen_ratio, 0.0, 1.0) || !within(options.budget_coarsen_ratio, 1e-3, 1.0) ||
      !within(options.speculation_weight, 0.0, 1.0) || !within(options.band_octaves, 0.0, 1e6) ||
      !within(options.bytes_per_triangle, 0.0, 1e9)) {
    return fail(ErrorKind::usage,
                "plan options: a ratio or weight is outside 0 to 1, or a size is not a sensible number");
  }
  return {};
}

struct Planner::State {
  explicit State(const CellTable& cells) : table(cells), judgements(cells), threshold_pass(cells) {}

  void hold(const PlanOptions& options, std::string reason);
  void judge_cells(const ViewJudge& judge, bool all);
  void find_live();
  void set_scales(const ViewJudge& judge, const PlanOptions& options, std::uint32_t first, std::uint32_t count,
                  CellScales& scales) const;
  void choose_targets(const ViewJudge& judge, const PlanOptions& options);
  void read_targets(const PlanOptions& options);
  void count_targets(const PlanOptions& options, bool whole, std::vector<std::uint8_t>& counts);
  void measure_targets();
  void cut_to_budget(const PlanOptions& options, bool memory, std::uint64_t room);
  std::uint64_t step_memory(const PlanOptions& options, std::uint32_t step) const;
  std::uint64_t mesh_memory(const PlanOptions& options, std::uint64_t triangles) const;
  void state_errors();
  void choose_wants(const PlanOptions& options);
  void choose_evictions(const PlanOptions& options);
  bool is_front(std::uint32_t cell, std::uint32_t prefix) const {
    return prefix < table.segment_count(cell) || table.child_count(cell) == 0;
  }

  const CellTable& table;
  Plan plan;

  std::optional<View> view;
  PlanOptions last_options;
  std::uint64_t table_epoch = 0;
  std::uint64_t judged_epoch = 0;
  std::uint64_t known_extents = 0;
  float cut = 0.0F;  // the budgets' threshold: what has a lower or equal level is given up
  bool cut_by_memory = false;

  KeptJudgements judgements;
  std::vector<ExtentPart> parts;    // scratch
  std::vector<std::uint8_t> fresh;  // by cell: judged in this call
  std::vector<std::uint8_t> live;
  std::vector<std::uint8_t> planned_live;
  std::vector<std::uint8_t> held;
  std::vector<std::uint8_t> whole_targets;  // the prefixes of which all generations will be in the mesh
  std::vector<std::uint8_t> kept;
  std::vector<std::uint8_t> kept_in_budget;
  StepThresholds thresholds;
  ThresholdPass threshold_pass;
  std::uint64_t needed_bytes = 0;  // of the targets' segments
  BudgetCut budget_cut;
  WantOrder want_order;
  std::vector<float> eviction_levels;
};

Planner::Planner(const CellTable& table) : state_(std::make_unique<State>(table)) {}
Planner::~Planner() = default;

const Plan& Planner::plan(const View& view, const PlanOptions& options) {
  State& s = *state_;
  const bool same_view = s.view == view;
  const bool same_options = s.view && s.last_options == options;
  if (same_view && same_options && s.table_epoch == s.table.epoch()) return s.plan;
  Result<void> valid = check_view(view);
  if (valid) valid = check_options(options);
  if (!valid) {
    s.view.reset();
    s.hold(options, valid.error().message);
    return s.plan;
  }
  const ViewJudge judge(view, options.criteria);
  if (!same_view || !same_options) s.cut = 0.0F;
  s.judge_cells(judge, !same_view || !same_options);
  s.view = view;
  s.last_options = options;
  s.table_epoch = s.table.epoch();
  s.find_live();
  s.choose_targets(judge, options);
  s.state_errors();
  s.choose_wants(options);
  s.choose_evictions(options);
  s.plan.settled = s.plan.missing_segments == 0 && s.plan.evictions.empty();
  for (std::uint32_t c = 0; s.plan.settled && c < s.table.cell_count(); ++c)
    s.plan.settled = s.plan.targets[c] == s.table.begun(c) && s.whole_targets[c] <= s.table.applied(c);
  return s.plan;
}

// Everything stays as it is.
void Planner::State::hold(const PlanOptions& options, std::string reason) {
  plan = {};
  plan.targets.resize(table.cell_count());
  for (std::uint32_t c = 0; c < table.cell_count(); ++c) plan.targets[c] = static_cast<std::uint8_t>(table.begun(c));
  plan.limitation = Limitation::bad_view;
  plan.reason = std::move(reason);
  plan.effective_tolerance_px = plan.stated_error_px = plan.planned_error_px = kInfinite;
  plan.hidden_error_px = plan.planned_hidden_error_px = kInfinite;
  plan.triangles = plan.planned_triangles = table.base_triangles() + table.begun_triangles();
  PlanOptions sizes;
  if (check_options(options)) sizes = options;
  plan.memory_bytes = plan.planned_memory_bytes = mesh_memory(sizes, plan.triangles) + table.held_bytes();
}

void Planner::State::judge_cells(const ViewJudge& judge, bool all) {
  const std::uint32_t count = table.cell_count();
  judgements.begin(judge.anywhere());
  fresh.assign(count, 0);
  std::uint64_t known = 0;
  for (std::uint32_t c = 0; c < count; ++c) {
    const std::uint32_t parent = table.parent(c);
    const bool parent_fresh = parent != CellTable::kNoCell && fresh[parent] != 0;
    if (table.extent_known(c)) {
      ++known;
      if (!all && !parent_fresh && table.extent_epoch(c) <= judged_epoch) continue;
      table.copy_parts(c, parts);
      CellJudgement judgement = judge.judge(table.extent(c), table.errors()[table.step_index(c, 1)], parts);
      if (parent != CellTable::kNoCell) narrow(judgement, judgements[parent]);
      judgements.set(c, judgement);
      fresh[c] = 1;
    } else if (parent != CellTable::kNoCell && (all || parent_fresh)) {
      fresh[c] = 1;  // with its parent
    }
  }
  if (known != known_extents) cut = 0.0F;
  known_extents = known;
  judged_epoch = table.epoch();
}

void Planner::State::find_live() {
  const std::uint32_t count = table.cell_count();
  live.resize(count);
  held.resize(count);
  for (std::uint32_t c = 0; c < count; ++c) {
    const std::uint32_t parent = table.parent(c);
    live[c] =
        parent == CellTable::kNoCell || (live[parent] != 0 && table.applied(parent) == table.segment_count(parent));
    held[c] = static_cast<std::uint8_t>(std::max(table.held(c), table.begun(c)));
  }
}

void Planner::State::set_scales(const ViewJudge& judge, const PlanOptions& options, std::uint32_t first,
                                std::uint32_t count, CellScales& scales) const {
  scales.resize(count);
  scales.near = to_float(std::max(1e-30, judge.anywhere().error.near));
  JudgementWalk judgement_of(judgements);
  for (std::uint32_t i = 0; i < count; ++i) {
    const CellJudgement& judgement = judgement_of(first + i);
    scales.set(i, judgement.error, live[first + i] != 0 || options.speculate ? judgement.weight : 0.0);
  }
}

// See SCHEDULING.md: what is above the tolerance, what is applied and above the coarsening tolerance, less what budgets
// cut.
void Planner::State::choose_targets(const ViewJudge& judge, const PlanOptions& options) {
  plan.limitation = Limitation::none;
  plan.reason.clear();
  const auto scales_of = [&](std::uint32_t first, std::uint32_t count, CellScales& scales) {
    set_scales(judge, options, first, count, scales);
  };
  threshold_pass.run(scales_of, to_float(options.tolerance_px * options.coarsen_ratio), thresholds);
  read_targets(options);
  measure_targets();
  const std::uint64_t base_memory = mesh_memory(options, table.base_triangles());
  if (table.base_triangles() > options.max_triangles || base_memory > options.max_memory_bytes) {
    plan.limitation = Limitation::base_over_budget;
    plan.reason = fmt::format("the base mesh alone takes {} triangles and {} bytes, more than the budget",
                              table.base_triangles(), base_memory);
    for (const float threshold : thresholds.values) cut = std::max(cut, threshold);
    std::fill(plan.targets.begin(), plan.targets.end(), std::uint8_t{0});
    whole_targets = plan.targets;
    measure_targets();
  } else {
    if (plan.planned_triangles > options.max_triangles)
      cut_to_budget(options, false, options.max_triangles - table.base_triangles());
    if (mesh_memory(options, plan.planned_triangles) + needed_bytes > options.max_memory_bytes)
      cut_to_budget(options, true, options.max_memory_bytes - base_memory);
    if (cut > to_float(options.tolerance_px)) {
      plan.limitation = cut_by_memory ? Limitation::memory_budget : Limitation::triangle_budget;
      plan.reason = fmt::format("refined to {:.3g} px instead of {:.3g} px, to stay within {} {}", cut,
                                options.tolerance_px, cut_by_memory ? options.max_memory_bytes : options.max_triangles,
                                cut_by_memory ? "bytes of memory" : "triangles");
    }
  }
  plan.effective_tolerance_px = std::max(options.tolerance_px, static_cast<double>(cut));
}

void Planner::State::read_targets(const PlanOptions& options) {
  count_targets(options, false, plan.targets);
  if (table.joins_generations()) {
    count_targets(options, true, whole_targets);
  } else {
    whole_targets = plan.targets;
  }
}

void Planner::State::count_targets(const PlanOptions& options, bool whole, std::vector<std::uint8_t>& counts) {
  const auto count = [&](float level, float factor, std::vector<std::uint8_t>& above) {
    count_steps_above(table, thresholds, whole ? thresholds.whole_rows : thresholds.begun_rows, level, factor, above);
  };
  count(std::max(to_float(options.tolerance_px), cut), 1.0F, counts);
  count(to_float(options.tolerance_px * options.coarsen_ratio), 1.0F, kept);
  if (cut > 0.0F) {
    count(cut, static_cast<float>(1.0 / options.budget_coarsen_ratio), kept_in_budget);
    for (std::size_t c = 0; c < kept.size(); ++c) kept[c] = std::min(kept[c], kept_in_budget[c]);
  }
  for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
    const auto there = static_cast<std::uint8_t>(whole ? table.applied(c) : table.begun(c));
    counts[c] = std::max(counts[c], std::min(kept[c], there));
  }
}

// Triangles and bytes of the targets, from those of what is applied and the differences.
void Planner::State::measure_targets() {
  std::uint64_t triangles = table.begun_triangles();
  std::uint64_t bytes = table.begun_bytes();
  for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
    const std::uint32_t applied = table.begun(c);
    const std::uint32_t target = plan.targets[c];
    for (std::uint32_t p = applied + 1; p <= target; ++p) {
      triangles += table.triangles()[table.step_index(c, p)];
      bytes += table.sizes_bytes()[table.step_index(c, p)];
    }
    for (std::uint32_t p = target + 1; p <= applied; ++p) {
      triangles -= table.triangles()[table.step_index(c, p)];
      bytes -= table.sizes_bytes()[table.step_index(c, p)];
    }
  }
  plan.planned_triangles = table.base_triangles() + triangles;
  needed_bytes = bytes;
}

std::uint64_t Planner::State::mesh_memory(const PlanOptions& options, std::uint64_t triangles) const {
  return table.base_memory_bytes() +
         static_cast<std::uint64_t>(std::ceil(static_cast<double>(triangles) * options.bytes_per_triangle));
}

std::uint64_t Planner::State::step_memory(const PlanOptions& options, std::uint32_t step) const {
  return table.sizes_bytes()[step] +
         static_cast<std::uint64_t>(std::ceil(table.triangles()[step] * options.bytes_per_triangle));
}

// Raises `cut` as far as this budget needs.
void Planner::State::cut_to_budget(const PlanOptions& options, bool memory, std::uint64_t room) {
  budget_cut.clear();
  const auto applied_factor = static_cast<float>(1.0 / options.budget_coarsen_ratio);
  for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
    for (std::uint32_t p = 1; p <= plan.targets[c]; ++p) {
      const std::uint32_t step = table.step_index(c, p);
      const float level = thresholds.begun(table, c, p) * (p <= table.begun(c) ? applied_factor : 1.0F);
      budget_cut.add(level, memory ? step_memory(options, step) : table.triangles()[step]);
    }
  }
  const float level = budget_cut.lowest_level(room);
  if (!(level > cut)) return;
  cut = level;
  cut_by_memory = memory;
  read_targets(options);
  measure_targets();
}

void Planner::State::state_errors() {
  double now[2] = {0.0, 0.0};  // hidden, seen
  double planned[2] = {0.0, 0.0};
  planned_live.resize(table.cell_count());
  JudgementWalk judgement_of(judgements);
  for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
    const std::uint32_t parent = table.parent(c);
    planned_live[c] = parent == CellTable::kNoCell ||
                      (planned_live[parent] != 0 && whole_targets[parent] == table.segment_count(parent));
    if (live[c] == 0 && planned_live[c] == 0) continue;
    const CellJudgement& judgement = judgement_of(c);
    if (!judgement.in_frustum) continue;
    const bool seen = judgement.can_be_seen();
    const std::uint32_t applied = table.applied(c);
    const std::uint32_t target = whole_targets[c];
    if (live[c] != 0 && is_front(c, applied))
      now[seen] = std::max(now[seen], judgement.error.px(table.error_at(c, applied)));
    if (planned_live[c] != 0 && is_front(c, target))
      planned[seen] = std::max(planned[seen], judgement.error.px(table.error_at(c, target)));
  }
  plan.stated_error_px = now[1];
  plan.hidden_error_px = now[0];
  plan.planned_error_px = planned[1];
  plan.planned_hidden_error_px = planned[0];
}

void Planner::State::choose_wants(const PlanOptions& options) {
  plan.missing_bytes = 0;
  plan.missing_segments = 0;
  for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
    for (std::uint32_t p = held[c] + 1U; p <= plan.targets[c]; ++p) {
      const std::uint32_t size = table.sizes_bytes()[table.step_index(c, p)];
      plan.missing_bytes += size;
      plan.missing_segments += size != 0;
    }
  }
  plan.wants.clear();
  if (plan.missing_segments != 0)
    want_order.order({table, judgements, thresholds, held, plan.targets, live}, options, plan.wants);
}

void Planner::State::choose_evictions(const PlanOptions& options) {
  plan.evictions.clear();
  plan.triangles = table.base_triangles() + table.begun_triangles();
  plan.memory_bytes = mesh_memory(options, plan.triangles) + table.held_bytes();
  plan.planned_memory_bytes = mesh_memory(options, plan.planned_triangles) + table.held_bytes() + plan.missing_bytes;
  if (plan.planned_memory_bytes <= options.max_memory_bytes) return;

  // A segment is worth at least what is held of its cell's children: they cannot be used without it.
  budget_cut.clear();
  eviction_levels.assign(table.cell_count(), 0.0F);
  const auto level_of = [&](std::uint32_t cell, std::uint32_t p) {
    const CellJudgement judgement = judgements[cell];
    const double px = judgement.error.px(table.errors()[table.step_index(cell, p)]);
    return std::max(eviction_levels[cell],
                    to_float(std::max(1e-30, px * std::max(kLeastKeepWeight, judgement.weight))));
  };
  for (std::uint32_t c = table.cell_count(); c-- > 0;) {
    const std::uint32_t first = plan.targets[c] + 1U;
    for (std::uint32_t p = held[c]; p >= first; --p)
      budget_cut.add(level_of(c, p), table.sizes_bytes()[table.step_index(c, p)]);
    if (const std::uint32_t parent = table.parent(c); parent != CellTable::kNoCell) {
      const float most = held[c] >= first ? level_of(c, first) : eviction_levels[c];
      eviction_levels[parent] = std::max(eviction_levels[parent], most);
    }
  }
  const std::uint64_t excess = plan.planned_memory_bytes - options.max_memory_bytes;
  const std::uint64_t evictable = budget_cut.total_cost();
  const float level = budget_cut.lowest_level(evictable - std::min(evictable, excess));
  std::vector<std::pair<float, Eviction>> chosen;
  for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
    std::uint32_t keep = held[c];
    while (keep > plan.targets[c] && level_of(c, keep) <= level) {
      plan.planned_memory_bytes -= table.sizes_bytes()[table.step_index(c, keep)];
      --keep;
    }
    if (keep < held[c]) chosen.push_back({level_of(c, held[c]), {c, keep}});
  }
  std::stable_sort(chosen.begin(), chosen.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& [ignored, eviction] : chosen) plan.evictions.push_back(eviction);
}

}  // namespace fanstream
