// Single levels of detail as a peer would ship them: meshoptimizer's simplifier, on the asset's grid, coded by
// Draco 10.
#pragma once

#include <cstddef>
#include <functional>

#include "common/grid/position_grid.h"
#include "common/mesh/triangle_mesh.h"
#include "common/support/result.h"

namespace fanstream::bench {

// The smallest i in (low, high] for which `reaches` holds, if what holds for one holds for all above it; `high` counts
// as one that it holds for. To within `close`.
Result<std::size_t> first_that(std::size_t low, std::size_t high, std::size_t close,
                               const std::function<Result<bool>(std::size_t)>& reaches);

// The fewest triangles of a model of so many with which a level is good enough, to a thousandth of them; at least 9.
Result<std::size_t> fewest_triangles(std::size_t all, const std::function<Result<bool>(std::size_t)>& is_good_enough);

// Of at most about so many triangles. `full` lies on the grid, as do the level's vertices.
Result<TriangleMesh> peer_level(const TriangleMesh& full, std::size_t triangles, const PositionGrid& grid);

Result<std::size_t> draco_bytes(const TriangleMesh& on_grid, const PositionGrid& grid);

}  // namespace fanstream::bench
