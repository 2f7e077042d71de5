#include "tests/bench/peer_level.h"

#include <algorithm>
#include <utility>

#include "client/session/draco_peer.h"
#include "tests/bench/meshoptimizer_peer.h"

namespace fanstream::bench {

Result<std::size_t> first_that(std::size_t low, std::size_t high, std::size_t close,
                               const std::function<Result<bool>(std::size_t)>& reaches) {
  while (high - low > std::max<std::size_t>(close, 1)) {
    const std::size_t middle = low + (high - low) / 2;
    const Result<bool> reached = reaches(middle);
    if (!reached) return tl::unexpected(reached.error());
    (*reached ? high : low) = middle;
  }
  return high;
}

Result<std::size_t> fewest_triangles(std::size_t all, const std::function<Result<bool>(std::size_t)>& is_good_enough) {
  constexpr std::size_t kTooFew = 8;
  std::size_t low = std::min(kTooFew, all);
  std::size_t high = all;
  // First by factors, so that `close` can be a share of what is found.
  while (high > 2 * low) {
    const Result<bool> enough = is_good_enough(high / 2);
    if (!enough) return tl::unexpected(enough.error());
    if (!*enough) {
      low = high / 2;
      break;
    }
    high /= 2;
  }
  return first_that(low, high, high / 1000, is_good_enough);
}

Result<TriangleMesh> peer_level(const TriangleMesh& full, std::size_t triangles, const PositionGrid& grid) {
  Result<SimplifyResult> simplified = simplify_with_meshoptimizer(full, {triangles});
  if (!simplified) return tl::unexpected(simplified.error());
  for (glm::dvec3& p : simplified->mesh.positions) p = grid.decode(grid.encode(p));
  return std::move(simplified->mesh);
}

Result<std::size_t> draco_bytes(const TriangleMesh& on_grid, const PositionGrid& grid) {
  const Result<GridMesh> mesh = grid_mesh(on_grid, grid.step());
  if (!mesh) return tl::unexpected(mesh.error());
  const Result<DracoFile> file = make_draco_file(*mesh, 10, 1);
  if (!file) return tl::unexpected(file.error());
  return file->bytes.size();
}

}  // namespace fanstream::bench
