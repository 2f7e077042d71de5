// In which order missing segments are asked for.
//
// A missing step x = (cell, p) gains
//     gain(x) = weight (error_px before - error_px after) * area_px
// and needs other missing steps. What it costs with all it forces: each step's cost is its bytes and, of every step it
// needs directly, that step's cost divided by the number of missing steps that need that one directly:
//     cost(x) = bytes(x) + sum over needs d of cost(d) / dependents(d),     worth(x) likewise from gain(x).
// So a cell that alone drags in a ring of neighbours pays for them all, and a region that is refined together shares.
//     utility(x) = max(worth(x) / cost(x), utility of every step that needs x).
// The order is by band (octaves of the closed threshold over the tolerance), within a band by utility, and coarse to
// fine among equals. Both rise along dependencies, so what a step needs stands before it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "client/view/cell_table.h"
#include "client/view/kept_judgements.h"
#include "client/view/planner.h"
#include "client/view/step_thresholds.h"

namespace fanstream {

struct WantInput {
  const CellTable& table;
  const KeptJudgements& judgements;
  const StepThresholds& thresholds;
  std::span<const std::uint8_t> held;     // by cell
  std::span<const std::uint8_t> targets;  // by cell
  std::span<const std::uint8_t> live;     // by cell: 1 if it exists in the mesh
};

// Scratch memory is kept between uses. Not thread safe.
class WantOrder {
 public:
  // The steps above `held` up to `targets`, at most options.max_wants of them. Empty segments are left out.
  void order(const WantInput& input, const PlanOptions& options, std::vector<Want>& wants);

 private:
  struct Step {
    std::uint32_t cell = 0;
    std::uint8_t p = 0;
    bool empty = false;      // nothing to send
    float threshold = 0.0F;  // speculative ones as much lower as options say
    float utility = 0.0F;
    double cost = 0.0;   // at last the share of each that needs it
    double worth = 0.0;  // likewise
    std::uint32_t dependents = 0;
    std::uint32_t needs_begin = 0;  // in needs_
    std::uint32_t needs_end = 0;
  };
  void collect(const WantInput& input, const PlanOptions& options);
  void find_needs(const WantInput& input);
  void share_costs();
  void raise_needs();
  void sort(const PlanOptions& options);
  std::vector<Step> steps_;  // coarse to fine
  std::uint32_t slot_of(const WantInput& input, std::uint32_t cell, std::uint32_t p) const {
    return slots_[first_slots_[cell] + p - input.held[cell] - 1];
  }

  std::vector<std::uint32_t> slots_;        // by cell, then by step: the places in steps_ of those that are missing
  std::vector<std::uint32_t> first_slots_;  // by cell, into slots_
  std::vector<std::uint32_t> needs_;        // slots of the missing steps that each step needs directly, cell by cell
  std::vector<std::uint32_t> layer_begins_;
  std::vector<std::uint32_t> keys_;
  std::vector<std::uint32_t> sorted_;
  std::vector<std::uint32_t> sorted_before_;
};

}  // namespace fanstream
