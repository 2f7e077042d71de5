// Whether an asset is its input: face for face on the asset's grid.
#pragma once

#include <string>

#include "common/grid/position_grid.h"
#include "common/mesh/triangle_mesh.h"
#include "common/support/result.h"

namespace fanstream {

// Encodes the cleaned input with the asset's grid and compares it with the asset's full mesh (in the grid's
// coordinates, as ProgressiveMesh::triangle_mesh gives them): the vertices as a multiset of grid points, the faces as a
// multiset of oriented triples of grid points. Numbers and order of vertices and faces do not matter. Returns what was
// compared in a few words; an error (bad_input) that names the first differences otherwise. `asset_name` and
// `input_name` stand in it.
Result<std::string> compare_with_source(const TriangleMesh& full, const PositionGrid& grid,
                                        const TriangleMesh& cleaned_input, const std::string& asset_name,
                                        const std::string& input_name);

}  // namespace fanstream
