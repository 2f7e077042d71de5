// Which segments that are held could not be decoded. Pure logic; not thread safe.
#pragma once

#include <map>
#include <span>
#include <string>
#include <utility>

#include "common/refine/progressive_mesh.h"
#include "protocol/runs.h"

namespace fanstream {

class DamagedSegments {
 public:
  void add(const MeshMove::Damage& damage);
  // The segments from `prefix` on of these cells were dropped: what comes in their place is new, and may be sound.
  void forget(std::span<const CellRun> released);
  bool empty() const { return messages_.empty(); }
  // Why the one of the first cell, and there the coarsest, cannot be decoded; nothing if there is none.
  std::string reason() const { return empty() ? std::string() : messages_.begin()->second; }

 private:
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::string> messages_;  // by cell and segment
};

}  // namespace fanstream
