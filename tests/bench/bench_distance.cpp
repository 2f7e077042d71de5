// How fast the distance measure is: building the tree, single queries, and a whole measurement.
// Example: fanstream-bench-distance --benchmark_filter=Closest
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <numbers>

#include "common/geometry/mesh_distance.h"
#include "common/geometry/triangle_tree.h"

namespace fanstream {
namespace {

// A sphere with bumps as a latitude-longitude grid, its poles pinched: 2 * rows * columns triangles.
TriangleMesh bumpy_sphere(unsigned rows, unsigned columns) {
  TriangleMesh mesh;
  for (unsigned r = 0; r <= rows; ++r) {
    for (unsigned c = 0; c < columns; ++c) {
      const double latitude = std::numbers::pi * (r + 0.5) / (rows + 1.0);
      const double longitude = 2.0 * std::numbers::pi * c / columns;
      const double radius = 1.0 + 0.05 * std::sin(9 * latitude) * std::sin(7 * longitude);
      mesh.positions.emplace_back(radius * std::sin(latitude) * std::cos(longitude),
                                  radius * std::sin(latitude) * std::sin(longitude), radius * std::cos(latitude));
    }
  }
  for (unsigned r = 0; r < rows; ++r) {
    for (unsigned c = 0; c < columns; ++c) {
      const VertexId a = r * columns + c;
      const VertexId b = r * columns + (c + 1) % columns;
      mesh.triangles.push_back({a, a + columns, b});
      mesh.triangles.push_back({b, a + columns, b + columns});
    }
  }
  return mesh;
}

const TriangleMesh& fine_mesh() {
  static const TriangleMesh mesh = bumpy_sphere(466, 934);  // 870,488 triangles
  return mesh;
}

const TriangleTree& fine_tree() {
  static const TriangleTree tree = *TriangleTree::build(fine_mesh());
  return tree;
}

void BuildTree(benchmark::State& state) {
  for (auto _ : state) {
    Result<TriangleTree> tree = TriangleTree::build(fine_mesh());
    benchmark::DoNotOptimize(tree);
  }
  state.counters["triangles/s"] = benchmark::Counter(static_cast<double>(fine_mesh().triangles.size()),
                                                     benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(BuildTree)->Unit(benchmark::kMillisecond);

// Queries off the surface by a given part of its diagonal, in millionths, walking along it.
void ClosestPoint(benchmark::State& state) {
  const TriangleMesh& mesh = fine_mesh();
  const TriangleTree& tree = fine_tree();
  const double factor = 1.0 + static_cast<double>(state.range(0)) * 1e-6 * std::sqrt(12.0);
  std::uint32_t hint = 0;
  std::size_t v = 0;
  for (auto _ : state) {
    const SurfacePoint nearest = tree.closest(mesh.positions[v] * factor, hint);
    hint = nearest.slot;
    if (++v == mesh.positions.size()) v = 0;
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(ClosestPoint)->Arg(0)->Arg(10)->Arg(100)->Arg(1000)->Arg(10'000);

void WholeMeasurement(benchmark::State& state) {
  const TriangleMesh coarse = bumpy_sphere(150, 300);
  std::int64_t samples = 0;
  for (auto _ : state) {
    const Result<MeshDistance> distance = mesh_distance(fine_mesh(), fine_tree(), coarse);
    samples += static_cast<std::int64_t>(distance->forward.samples + distance->backward.samples);
  }
  state.SetItemsProcessed(samples);
}
BENCHMARK(WholeMeasurement)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace fanstream

BENCHMARK_MAIN();
