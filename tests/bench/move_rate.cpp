#include "tests/bench/move_rate.h"

#include <malloc.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "tests/bench/machine.h"
#include "tests/bench/thread_clock.h"

namespace fanstream::bench {

namespace {

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Result<void> add_all_segments(const OpenAsset& asset, ProgressiveMesh& mesh) {
  for (std::uint32_t c = 0; c < asset.cell_count(); ++c) {
    for (std::uint32_t s = 0; s < asset.segment_count(c); ++s) {
      if (Result<void> added = mesh.add_segment(c, s, asset.segment(c, s)); !added) return added;
    }
  }
  return {};
}

// Splits per second of a move that has to do `splits` of them.
Result<double> rate_of_move(ProgressiveMesh& mesh, std::uint32_t target, std::uint64_t splits) {
  mesh.set_all_targets(target);
  const double start = thread_cpu_seconds();
  const MeshMove move = mesh.move_to({});
  const double seconds = thread_cpu_seconds() - start;
  if (!move.damage.empty()) return tl::unexpected(move.damage.front().error);
  if (move.applied + move.undone != splits) {
    return fail(ErrorKind::bad_input,
                "a move did " + std::to_string(move.applied + move.undone) + " splits of " + std::to_string(splits));
  }
  return static_cast<double>(splits) / seconds;
}

View turned(const View& view, double degrees) {
  const double angle = degrees * std::numbers::pi / 180.0;
  const glm::dvec3 offset = view.camera.eye - view.camera.target;
  View result = view;
  result.camera.eye = view.camera.target + glm::dvec3(std::cos(angle) * offset.x + std::sin(angle) * offset.z, offset.y,
                                                      std::cos(angle) * offset.z - std::sin(angle) * offset.x);
  return result;
}

double plan_ms(ViewModel& model, const View& near_by, const View& back, const PlanOptions& options, int repetitions) {
  std::vector<double> ms;
  for (int i = 0; i < repetitions; ++i) {
    const View& view = i % 2 == 0 ? near_by : back;
    const double start = thread_cpu_seconds();
    (void)model.plan(view, options);
    ms.push_back(1e3 * (thread_cpu_seconds() - start));
  }
  return median(std::move(ms));
}

}  // namespace

Result<MoveRates> measure_move_rates(const OpenAsset& asset, int repetitions) {
  MoveRates rates;
  rates.splits = asset.asset_head()->vertex_count - static_cast<std::uint32_t>(asset.asset_head()->base.places.size());
  if (rates.splits == 0) return fail(ErrorKind::bad_input, "there is nothing to refine");
  std::vector<double> all[3];
  for (int i = 0; i < repetitions; ++i) {
    ProgressiveMesh mesh(asset.asset_head(), MeshMemory::live_part);
    mesh.set_index(asset.asset_index());
    if (Result<void> added = add_all_segments(asset, mesh); !added) return tl::unexpected(added.error());
    for (int step = 0; step < 3; ++step) {
      const Result<double> rate = rate_of_move(mesh, step == 1 ? 0 : ProgressiveMesh::kEverySegment, rates.splits);
      if (!rate) return tl::unexpected(rate.error());
      all[step].push_back(*rate);
    }
  }
  rates.apply_per_s = median(all[0]);
  rates.undo_per_s = median(all[1]);
  rates.reapply_per_s = median(all[2]);
  return rates;
}

namespace {

// The child's part: everything that a client has of a model is made here, head and index included.
Result<ClientMemory> grow(const std::shared_ptr<const OpenAsset>& asset, const View& view, const PlanOptions& options,
                          StopAt stop) {
  malloc_trim(0);
  const std::uint64_t before = own_resident_bytes();
  if (before == 0) return fail(ErrorKind::io, "/proc does not tell how large a process is");
  Result<ViewDelivery> delivery = ViewDelivery::start(asset, ViewDelivery::Tables::own);
  if (!delivery) return tl::unexpected(delivery.error());
  const Result<ViewBytes> delivered = delivery->deliver(view, options, stop);
  if (!delivered) return tl::unexpected(delivered.error());
  const std::uint64_t after = own_resident_bytes();
  const ProgressiveMesh& mesh = delivery->model().mesh();
  return ClientMemory{after > before ? after - before : 0, mesh.memory_bytes(), mesh.state().fans.triangles().size()};
}

struct Answer {
  bool good = false;
  ClientMemory memory;
  char problem[256] = {};
};

Answer answer_of(const Result<ClientMemory>& grown) {
  Answer answer;
  answer.good = grown.has_value();
  if (grown) answer.memory = *grown;
  if (!grown) std::snprintf(answer.problem, sizeof answer.problem, "%s", grown.error().message.c_str());
  return answer;
}

}  // namespace

Result<ClientMemory> measure_client_memory(const std::shared_ptr<const OpenAsset>& asset, const View& view,
                                           const PlanOptions& options, StopAt stop) {
  int ends[2];
  if (pipe(ends) != 0) return fail(ErrorKind::io, "no pipe to another process");
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    const Answer answer = answer_of(grow(asset, view, options, stop));
    _exit(write(ends[1], &answer, sizeof answer) == static_cast<ssize_t>(sizeof answer) ? 0 : 1);
  }
  close(ends[1]);
  Answer answer;
  const bool told = child > 0 && read(ends[0], &answer, sizeof answer) == static_cast<ssize_t>(sizeof answer);
  close(ends[0]);
  if (child > 0) waitpid(child, nullptr, 0);
  if (!told) return fail(ErrorKind::io, "the process that measures memory did not answer");
  if (!answer.good) return fail(ErrorKind::bad_input, answer.problem);
  return answer.memory;
}

Result<PlanTime> measure_plan_time(const std::shared_ptr<const OpenAsset>& asset, const View& view,
                                   const PlanOptions& options, int repetitions) {
  Result<ViewDelivery> delivery = ViewDelivery::start(asset);
  if (!delivery) return tl::unexpected(delivery.error());
  const Result<ViewBytes> settled = delivery->deliver(view, options, StopAt::nothing_wanted);
  if (!settled) return tl::unexpected(settled.error());
  PlanTime time;
  time.cells = asset->cell_count();
  time.small_move_ms = plan_ms(delivery->model(), turned(view, 0.01), view, options, repetitions);
  time.large_move_ms = plan_ms(delivery->model(), turned(view, 10.0), view, options, repetitions);
  return time;
}

}  // namespace fanstream::bench
