#include "tests/bench/meshoptimizer_peer.h"

#include <meshoptimizer.h>

#include <cfloat>
#include <chrono>
#include <limits>
#include <string>
#include <vector>

namespace fanstream::bench {

namespace {

TriangleMesh used_part(const TriangleMesh& mesh, const std::vector<unsigned>& indices) {
  constexpr VertexId kUnused = std::numeric_limits<VertexId>::max();
  std::vector<VertexId> renumbered(mesh.positions.size(), kUnused);
  TriangleMesh result;
  result.triangles.reserve(indices.size() / 3);
  const auto keep = [&](VertexId v) {
    if (renumbered[v] == kUnused) {
      renumbered[v] = static_cast<VertexId>(result.positions.size());
      result.positions.push_back(mesh.positions[v]);
    }
    return renumbered[v];
  };
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
    const VertexId a = keep(indices[i]);
    const VertexId b = keep(indices[i + 1]);
    const VertexId c = keep(indices[i + 2]);
    result.triangles.push_back({a, b, c});
  }
  return result;
}

}  // namespace

Result<SimplifyResult> simplify_with_meshoptimizer(const TriangleMesh& mesh, const SimplifyOptions& options) {
  if (mesh.triangles.empty()) return fail(ErrorKind::bad_input, "the mesh has no triangles");
  std::vector<float> positions;
  positions.reserve(mesh.positions.size() * 3);
  // Seen from the middle, so that a model far from the origin keeps its detail in floats.
  const Bounds bounds = bounds_of(mesh.positions);
  const glm::dvec3 centre = (bounds.low + bounds.high) * 0.5;
  for (const glm::dvec3& p : mesh.positions) {
    for (int axis = 0; axis < 3; ++axis) positions.push_back(static_cast<float>(p[axis] - centre[axis]));
  }
  std::vector<unsigned> indices;
  indices.reserve(mesh.triangles.size() * 3);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (const VertexId v : mesh.triangles[i]) {
      if (v >= mesh.positions.size()) {
        return fail(ErrorKind::bad_input, "triangle " + std::to_string(i) + " names vertex " + std::to_string(v) +
                                              " of " + std::to_string(mesh.positions.size()));
      }
      indices.push_back(v);
    }
  }

  std::vector<unsigned> simplified(indices.size());
  const auto start = std::chrono::steady_clock::now();
  const std::size_t count = meshopt_simplify(
      simplified.data(), indices.data(), indices.size(), positions.data(), mesh.positions.size(), 3 * sizeof(float),
      options.target_triangles * 3, FLT_MAX, options.lock_border ? unsigned{meshopt_SimplifyLockBorder} : 0U, nullptr);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  simplified.resize(count);
  return SimplifyResult{used_part(mesh, simplified), elapsed.count()};
}

}  // namespace fanstream::bench
