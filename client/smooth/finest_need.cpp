#include "client/smooth/finest_need.h"

namespace fanstream {

// A cell's vertices fall to its children in equal shares; its own and their splits add to them.
FinestNeed::FinestNeed(const AssetHead& head, const AssetIndex& index) : final_vertices_(index.cells.size(), 0.0F) {
  std::vector<float> splits(index.cells.size(), 0.0F);  // with those of all descendants
  for (std::size_t c = index.cells.size(); c-- > 0;) {
    const CellEntry& cell = index.cells[c];
    if (index.is_known(static_cast<std::uint32_t>(c))) {
      splits[c] += static_cast<float>(cell.split_count);
    } else {  // what its parent announces of all its children
      const CellEntry& parent = index.cells[cell.parent];
      splits[c] += static_cast<float>(parent.child_splits) / static_cast<float>(parent.child_count);
    }
    if (cell.slab > 0) splits[cell.parent] += splits[c];
  }
  std::vector<float> initial(index.cells.size(), 0.0F);
  for (std::size_t c = 0; c < index.cells.size(); ++c) {
    const CellEntry& cell = index.cells[c];
    initial[c] = cell.slab == 0 ? static_cast<float>(head.base.places.size()) / static_cast<float>(head.root_cell_count)
                                : (initial[cell.parent] + static_cast<float>(index.cells[cell.parent].split_count)) /
                                      static_cast<float>(index.cells[cell.parent].child_count);
    final_vertices_[c] = initial[c] + splits[c];
  }
}

bool FinestNeed::decide(const View& view, const Criteria& criteria, const CellTable& table,
                        const ProgressiveMesh& mesh) {
  const ViewJudge judge(view, criteria);
  std::vector<ExtentPart> parts;
  finest_triangles_ = 0.0;
  for (std::uint32_t c = 0; c < final_vertices_.size(); ++c) {
    if (!mesh.is_live(c)) continue;
    table.copy_parts(c, parts);
    if (table.extent_known(c) && !judge.judge(table.extent(c), table.error_at(c, 0), parts).in_frustum) continue;
    finest_triangles_ += 2.0 * static_cast<double>(final_vertices_[c]);
  }
  const double picture_px = static_cast<double>(view.width_px) * view.height_px;
  needed_ = finest_triangles_ * (needed_ ? kPxPerTriangleToStay : kPxPerTriangle) <= picture_px;
  return needed_;
}

}  // namespace fanstream
