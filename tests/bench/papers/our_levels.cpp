#include "tests/bench/papers/our_levels.h"

#include <fmt/format.h>

#include "server/build/layer_plan.h"

namespace fanstream::bench {
namespace {

std::vector<GridPoint> places_on(const PositionGrid& grid, const TriangleMesh& mesh) {
  std::vector<GridPoint> places;
  for (const glm::dvec3& p : mesh.positions) places.push_back(grid.encode(p));
  return places;
}

}  // namespace

OurLevels::OurLevels(const TriangleMesh& mesh, MergeHistory history)
    : grid_(PositionGrid::fit(mesh.positions, PositionGrid::default_bits(mesh))),
      history_(std::move(history)),
      coded_(history_, places_on(grid_, mesh), grid_),
      replay_(coded_, grid_, static_cast<std::uint32_t>(mesh.positions.size())) {}

Result<std::unique_ptr<OurLevels>> OurLevels::build(const TriangleMesh& mesh,
                                                    std::optional<std::uint32_t> base_vertices) {
  if (!base_vertices) {
    const Result<BuiltAsset> built = build_asset(mesh, {});
    if (!built) return tl::unexpected(built.error());
    base_vertices = built->report.base_vertices;
  }
  const Granularity usual = default_granularity(static_cast<std::uint32_t>(mesh.positions.size()));
  SimplifyOptions options;
  options.base_vertices = *base_vertices;
  options.edges_per_vertex = usual.edges_per_vertex;
  options.evenness = usual.evenness;
  options.distance_growth = usual.distance_growth;
  MergeHistory history = simplify(mesh, options);
  if (history.base_vertices != *base_vertices) {
    return fail(ErrorKind::limit,
                fmt::format("merging ended at {} vertices, {} are wanted", history.base_vertices, *base_vertices));
  }
  return std::unique_ptr<OurLevels>(new OurLevels(mesh, std::move(history)));
}

TriangleMesh OurLevels::level(std::uint32_t vertices) {
  replay_.refine_to(vertices);
  return replay_.mesh();
}

}  // namespace fanstream::bench
