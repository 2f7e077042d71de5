// How fast a mesh that follows a view is refined and coarsened, and what it takes in memory.
#pragma once

#include <cstdint>
#include <memory>

#include "tests/bench/view_bytes.h"

namespace fanstream::bench {

// Splits per second of CPU time on one core, medians. All segments are held from the start; everything is applied to a
// new mesh, undone down to FM0, and applied again.
struct MoveRates {
  std::uint32_t splits = 0;
  double apply_per_s = 0.0;
  double undo_per_s = 0.0;
  double reapply_per_s = 0.0;
};
// Fails (bad_input) where not every split is applied and undone.
Result<MoveRates> measure_move_rates(const OpenAsset& asset, int repetitions);

// What a process grows by, resident, when it reads head and index, makes a ViewModel, and is handed segments. The
// program's code, of which pages come in where they are first run, is not a model's and left out.
struct ClientMemory {
  std::uint64_t grown_bytes = 0;
  std::uint64_t counted_bytes = 0;  // ProgressiveMesh::memory_bytes(), which is part of it
  std::uint64_t triangles = 0;      // live
  double bytes_per_triangle() const { return static_cast<double>(grown_bytes) / static_cast<double>(triangles); }
};
// In a process of its own, forked from this one after free memory has been given back; so what fits into the remains of
// free pages counts nothing. Fails (io) where there is no /proc, or no process. Call it while there is one thread only.
Result<ClientMemory> measure_client_memory(const std::shared_ptr<const OpenAsset>& asset, const View& view,
                                           const PlanOptions& options, StopAt stop);

// Milliseconds of CPU time for a full plan, medians: a view settled, then the camera goes around its target and back.
struct PlanTime {
  std::uint32_t cells = 0;
  double small_move_ms = 0.0;  // by a hundredth of a degree
  double large_move_ms = 0.0;  // by ten degrees
};
Result<PlanTime> measure_plan_time(const std::shared_ptr<const OpenAsset>& asset, const View& view,
                                   const PlanOptions& options, int repetitions = 50);

}  // namespace fanstream::bench
