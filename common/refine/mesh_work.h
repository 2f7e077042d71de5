// Private to ProgressiveMesh's sources.
#pragma once

#include "common/refine/progressive_mesh.h"

namespace fanstream {

struct ProgressiveMesh::Work {
  MeshMove move;
  std::uint64_t split_budget = kNoBudget;
  bool stop_at_damage = false;
  bool in_step = false;  // no cell is to go ahead for another's sake

  bool must_stop() const {
    return move.applied + move.undone >= split_budget || (stop_at_damage && !move.damage.empty());
  }
};

}  // namespace fanstream
