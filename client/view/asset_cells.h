// The planner's table of an asset, from its head and index.
#pragma once

#include "client/view/cell_table.h"
#include "common/asset/asset_layout.h"

namespace fanstream {

// Nothing is applied or held, no extents or neighbours are known. An asset does not say how many triangles a segment
// adds: those of a cell (two a split) are shared out by its segments' bytes, for good, so that budgets do not waver as
// segments are decoded. Head and index must be of one asset, as read_head and read_index give them. Fails (bad_input,
// starting with `name`) where bounds rise from coarse to fine.
//
// A page is the last segment of the cell that has it: of its own size until the children are known, of none from then
// on. Before it, what the cell is off is what its entry says of its children; they have no bounds and no segments yet.
Result<CellTable> cell_table_of(const AssetHead& head, const AssetIndex& index, const std::string& name);
// The same for the children of one cell that the index has come to know.
void learn_children(const AssetHead& head, const AssetIndex& index, std::uint32_t parent, CellTable& table);

}  // namespace fanstream
