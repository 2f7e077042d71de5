#include "tests/bench/draco_peer.h"

#include <algorithm>
#include <cmath>

namespace fanstream::bench {

GridMesh on_grid(const TriangleMesh& mesh, unsigned bits) {
  const Bounds bounds = bounds_of(mesh.positions);
  const glm::dvec3 extent = bounds.high - bounds.low;
  const double longest = std::max({extent.x, extent.y, extent.z});
  const double steps_per_unit = longest > 0.0 ? std::ldexp(1.0, static_cast<int>(bits)) - 1.0 : 0.0;
  GridMesh result;
  result.triangles = mesh.triangles;
  result.positions.reserve(mesh.positions.size());
  for (const glm::dvec3& p : mesh.positions) {
    std::array<std::int32_t, 3> q{};
    for (int axis = 0; axis < 3; ++axis) {
      const double part = longest > 0.0 ? (p[axis] - bounds.low[axis]) / longest : 0.0;
      q[static_cast<std::size_t>(axis)] = static_cast<std::int32_t>(std::floor(part * steps_per_unit + 0.5));
    }
    result.positions.push_back(q);
  }
  return result;
}

DracoResult draco_result(const DracoFile& file, const GridMesh& mesh) {
  DracoResult result;
  result.size_bytes = file.bytes.size();
  result.encode_seconds = file.encode_seconds;
  result.decode_seconds = file.decode_seconds;
  result.decode_mtriangles_s = static_cast<double>(mesh.triangles.size()) / file.decode_seconds * 1e-6;
  result.bits_per_vertex = 8.0 * static_cast<double>(result.size_bytes) / static_cast<double>(mesh.positions.size());
  return result;
}

Result<DracoResult> measure_draco(const GridMesh& mesh, int level, int decode_repetitions) {
  const Result<DracoFile> file = make_draco_file(mesh, level, decode_repetitions);
  if (!file) return tl::unexpected(file.error());
  return draco_result(*file, mesh);
}

}  // namespace fanstream::bench
