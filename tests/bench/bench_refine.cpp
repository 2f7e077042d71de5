// How fast a mesh is refined and coarsened in place, and what it takes in memory, on assets that are given.
// Example: fanstream-bench-refine dragon.fan --benchmark_filter=Walk
//
// Whole: every split applied, and undone. Walk: a point wanders over the surface, around which the model is full and
// coarser with the distance, as for a camera close by; CPU time is that of move_to alone, frames are the iterations.
// Resident: a new mesh at a share of the splits, all over (Even) or around a point (Near); resident_B is what the
// process grew by, counted_B what memory_bytes() says, both per triangle.
#include <benchmark/benchmark.h>
#include <malloc.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <random>

#include "common/asset/asset_file.h"
#include "common/refine/progressive_mesh.h"
#include "tests/bench/thread_clock.h"

namespace fanstream {
namespace {

std::unique_ptr<ProgressiveMesh> with_all_segments(const AssetFile& asset, MeshMemory memory) {
  auto mesh = std::make_unique<ProgressiveMesh>(asset.asset_head(), memory);
  mesh->set_index(asset.asset_index());
  mesh->set_all_targets(0);
  for (std::uint32_t c = 0; c < asset.cell_count(); ++c) {
    for (std::uint32_t s = 0; s < asset.segment_count(c); ++s) {
      if (!mesh->add_segment(c, s, asset.segment(c, s))) std::abort();
    }
  }
  return mesh;
}

// Where a cell's part of the full model lies.
std::vector<glm::dvec3> cell_centres(const AssetFile& asset) {
  const auto mesh = with_all_segments(asset, MeshMemory::whole_model);
  if (!mesh->refine()) std::abort();
  std::vector<glm::dvec3> centres(asset.cell_count(), glm::dvec3(0.0));
  for (std::uint32_t c = asset.cell_count(); c-- > 0;) {
    const CellEntry& entry = mesh->index().cells[c];
    if (mesh->is_live(c)) {
      centres[c] = mesh->bounds(c).centre;
      continue;
    }
    for (std::uint32_t i = 0; i < entry.child_count; ++i) {
      centres[c] += centres[entry.first_child + i] / static_cast<double>(entry.child_count);
    }
  }
  return centres;
}

// The targets of a view from close by: the finest generation within `radius` of a point, one less with every further
// factor of `falloff`.
class NearView {
 public:
  explicit NearView(const AssetFile& asset)
      : head_(*asset.asset_head()), index_(*asset.asset_index()), centres_(cell_centres(asset)) {
    glm::dvec3 low = centres_.front();
    glm::dvec3 high = low;
    for (const glm::dvec3& c : centres_) {
      low = glm::min(low, c);
      high = glm::max(high, c);
    }
    diagonal_ = glm::length(high - low);
    given_.assign(centres_.size(), 0);
  }

  double diagonal() const { return diagonal_; }
  const std::vector<glm::dvec3>& centres() const { return centres_; }

  // Those that differ from the last call's.
  std::vector<CellTarget> targets(const glm::dvec3& point, double radius, double falloff) {
    std::vector<CellTarget> changed;
    for (std::uint32_t c = 0; c < centres_.size(); ++c) {
      const double away = glm::length(centres_[c] - point) / radius;
      const double lost = away <= 1.0 ? 0.0 : std::log(away) / std::log(falloff);
      const double finest = head_.generation_count() - lost;
      const std::uint32_t first = head_.layer_begin(index_.cells[c].slab);
      std::uint32_t segments = 0;
      while (segments < index_.cells[c].segment_count && head_.layer_ends[first + segments] <= finest) ++segments;
      if (segments != given_[c]) changed.push_back({c, segments});
      given_[c] = segments;
    }
    return changed;
  }

 private:
  const AssetHead& head_;
  const AssetIndex& index_;
  std::vector<glm::dvec3> centres_;
  std::vector<std::uint32_t> given_;
  double diagonal_ = 0.0;
};

void count_splits(benchmark::State& state, double splits) {
  state.counters["splits/s"] = benchmark::Counter(splits, benchmark::Counter::kIsRate);
}

void whole(benchmark::State& state, const AssetFile& asset, bool undoing) {
  const auto mesh = with_all_segments(asset, MeshMemory::live_part);
  double splits = 0;
  for (auto _ : state) {
    const auto apply = [&] {
      mesh->set_all_targets(ProgressiveMesh::kEverySegment);
      const MeshMove move = mesh->move_to({});
      if (!undoing) splits += static_cast<double>(move.applied);
    };
    const auto undo = [&] {
      mesh->set_all_targets(0);
      const MeshMove move = mesh->move_to({});
      if (undoing) splits += static_cast<double>(move.undone);
    };
    if (undoing) {
      state.PauseTiming();
      apply();
      state.ResumeTiming();
      undo();
    } else {
      apply();
      state.PauseTiming();
      undo();
      state.ResumeTiming();
    }
  }
  count_splits(state, splits);
}

void walk(benchmark::State& state, const AssetFile& asset) {
  NearView view(asset);
  const auto mesh = with_all_segments(asset, MeshMemory::live_part);
  std::mt19937_64 random(5);
  const std::vector<glm::dvec3>& places = view.centres();
  glm::dvec3 at = places[random() % places.size()];
  glm::dvec3 goal = at;
  const double pace = view.diagonal() / 200.0;
  (void)mesh->move_to(view.targets(at, view.diagonal() / 30.0, 1.25));
  double splits = 0;
  double slowest = 0;
  double triangles = 0;
  for (auto _ : state) {
    if (glm::length(goal - at) < pace) goal = places[random() % places.size()];
    at += glm::normalize(goal - at + glm::dvec3(1e-9)) * pace;
    const auto targets = view.targets(at, view.diagonal() / 30.0, 1.25);
    const double begin = bench::thread_cpu_seconds();
    const MeshMove move = mesh->move_to(targets);
    const double seconds = bench::thread_cpu_seconds() - begin;
    state.SetIterationTime(seconds);
    slowest = std::max(slowest, seconds);
    splits += static_cast<double>(move.applied + move.undone);
    triangles += 2.0 * mesh->vertex_count();
  }
  count_splits(state, splits);
  state.counters["splits"] = benchmark::Counter(splits, benchmark::Counter::kAvgIterations);
  state.counters["triangles"] = benchmark::Counter(triangles, benchmark::Counter::kAvgIterations);
  state.counters["slowest_ms"] = slowest * 1e3;
}

// The bounds of every live cell after each has changed.
void bounds(benchmark::State& state, const AssetFile& asset) {
  const auto mesh = with_all_segments(asset, MeshMemory::live_part);
  std::size_t cells = 0;
  for (auto _ : state) {
    state.PauseTiming();
    mesh->set_all_targets(0);
    (void)mesh->move_to({});
    mesh->set_all_targets(ProgressiveMesh::kEverySegment);
    (void)mesh->move_to({});
    state.ResumeTiming();
    for (std::uint32_t c = 0; c < asset.cell_count(); ++c) {
      if (!mesh->is_live(c)) continue;
      benchmark::DoNotOptimize(mesh->bounds(c));
      ++cells;
    }
  }
  state.counters["cells/s"] = benchmark::Counter(static_cast<double>(cells), benchmark::Counter::kIsRate);
}

std::size_t resident_bytes() {
  std::FILE* const file = std::fopen("/proc/self/statm", "r");
  unsigned long long pages = 0;
  if (file == nullptr || std::fscanf(file, "%*u %llu", &pages) != 1) std::abort();
  std::fclose(file);
  return static_cast<std::size_t>(pages) * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

// Adds the segments it takes alone, as a client would have them.
void resident(benchmark::State& state, const AssetFile& asset, bool near, double share) {
  const AssetHead& head = *asset.asset_head();
  const AssetIndex& index = *asset.asset_index();
  const auto wanted = static_cast<std::uint32_t>(share * head.vertex_count);
  std::vector<std::uint32_t> segments(asset.cell_count(), 0);
  {
    const auto mesh = with_all_segments(asset, MeshMemory::whole_model);
    NearView view(asset);
    double radius = view.diagonal() / 1000.0;
    while (near && share < 1.0 && mesh->vertex_count() < wanted) {
      (void)mesh->move_to(view.targets(view.centres().back(), radius, 1.25));
      radius *= 1.1;
    }
    if (near && share >= 1.0) (void)mesh->refine();
    if (!near && !mesh->refine(wanted)) std::abort();
    for (std::uint32_t c = 0; c < asset.cell_count(); ++c) {
      const std::uint32_t begin = head.layer_begin(index.cells[c].slab);
      while (segments[c] < index.cells[c].segment_count &&
             head.first_generation(begin + segments[c]) <= mesh->applied_generation(c)) {
        ++segments[c];
      }
    }
  }
  double grown = 0;
  double counted = 0;
  double triangles = 0;
  for (auto _ : state) {
    malloc_trim(0);
    const std::size_t before = resident_bytes();
    ProgressiveMesh mesh(asset.asset_head(), MeshMemory::live_part);
    mesh.set_index(asset.asset_index());
    for (std::uint32_t c = 0; c < asset.cell_count(); ++c) {
      for (std::uint32_t s = 0; s < segments[c]; ++s) (void)mesh.add_segment(c, s, asset.segment(c, s));
    }
    if (near ? !mesh.move_to({}).finished : !mesh.refine(wanted).has_value()) std::abort();
    grown = static_cast<double>(resident_bytes() - before);
    counted = static_cast<double>(mesh.memory_bytes());
    triangles = static_cast<double>(mesh.state().fans.triangles().size());
  }
  state.counters["triangles"] = triangles;
  state.counters["resident_B"] = grown / triangles;
  state.counters["counted_B"] = counted / triangles;
}

void add_benchmarks(const std::string& name, const std::shared_ptr<const AssetFile>& asset) {
  const auto add = [&](const std::string& what, auto run) {
    return benchmark::RegisterBenchmark((what + "/" + name).c_str(), run)->Unit(benchmark::kMillisecond);
  };
  add("ApplyWhole", [asset](benchmark::State& state) { whole(state, *asset, false); });
  add("UndoWhole", [asset](benchmark::State& state) { whole(state, *asset, true); });
  add("Walk", [asset](benchmark::State& state) { walk(state, *asset); })->UseManualTime();
  add("Bounds", [asset](benchmark::State& state) { bounds(state, *asset); });
  for (const bool near : {false, true}) {
    for (const double share : {0.05, 0.1, 0.3, 0.5, 1.0}) {
      add(std::string(near ? "ResidentNear/" : "ResidentEven/") + std::to_string(static_cast<int>(share * 100)),
          [=](benchmark::State& state) { resident(state, *asset, near, share); })
          ->Iterations(1);
    }
  }
}

}  // namespace
}  // namespace fanstream

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (argc < 2) {
    std::fprintf(stderr, "usage: %s ASSET... [--benchmark_...]\n", argv[0]);
    return 2;
  }
  for (int i = 1; i < argc; ++i) {
    const auto asset = fanstream::AssetFile::open(argv[i]);
    if (!asset) {
      std::fprintf(stderr, "%s\n", asset.error().message.c_str());
      return 5;
    }
    fanstream::add_benchmarks(std::filesystem::path(argv[i]).stem().string(), *asset);
  }
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
