#include "client/view/asset_cells.h"

#include <cmath>

namespace fanstream {
namespace {

// Codes are multiplied out in double precision; the table must not round them down.
float no_less(double error) {
  const auto rounded = static_cast<float>(error);
  return rounded < error ? std::nextafter(rounded, INFINITY) : rounded;
}

glm::dvec3 middle_of(const PositionGrid& grid) {
  const Bounds bounds = grid.bounds();
  return 0.5 * (bounds.low + bounds.high);
}

void set_page(const AssetHead& head, const AssetIndex& index, std::uint32_t cell, CellTable& table) {
  const CellEntry& entry = index.cells[cell];
  table.set_segment(cell, entry.segment_count,
                    {no_less(error_from_code(entry.rest_code, head.grid.step())),
                     index.knows_children(cell) ? 0 : entry.page_bytes, 0});
}

void set_segments(const AssetHead& head, const AssetIndex& index, std::uint32_t cell, CellTable& table) {
  if (!index.is_known(cell)) return;
  if (index.has_page(cell)) set_page(head, index, cell, table);
  const CellEntry& entry = index.cells[cell];
  std::uint64_t all_bytes = 0;
  for (std::uint32_t s = 0; s < entry.segment_count; ++s)
    all_bytes += index.segments[entry.first_segment + s].size_bytes;
  std::uint64_t bytes = 0;
  std::uint64_t triangles = 0;
  for (std::uint32_t s = 0; s < entry.segment_count; ++s) {
    const SegmentEntry& segment = index.segments[entry.first_segment + s];
    bytes += segment.size_bytes;
    const std::uint64_t until = all_bytes == 0 ? 0 : 2 * std::uint64_t{entry.split_count} * bytes / all_bytes;
    table.set_segment(cell, s,
                      {no_less(error_from_code(segment.error_code, head.grid.step())), segment.size_bytes,
                       static_cast<std::uint32_t>(until - triangles)});
    triangles = until;
  }
}

}  // namespace

Result<CellTable> cell_table_of(const AssetHead& head, const AssetIndex& index, const std::string& name) {
  std::vector<SlabShape> slabs(head.slab_ends.size());
  for (std::uint32_t s = 0; s < slabs.size(); ++s) slabs[s].layer_count = head.layers_of(s);
  if (head.has_pages) ++slabs[slabs.size() - 2].layer_count;
  std::vector<std::uint32_t> child_counts;
  for (const CellEntry& entry : index.cells) {
    ++slabs[entry.slab].cell_count;
    if (entry.slab + 1 < slabs.size()) child_counts.push_back(entry.child_count);
  }
  Result<CellTable> table = CellTable::create(slabs, child_counts);
  if (!table) return tl::unexpected(with_context(table.error(), name));
  for (std::uint32_t s = 0; s < slabs.size(); ++s) {
    for (std::uint32_t l = 0; l < head.layers_of(s); ++l) {
      const std::uint32_t layer = head.layer_begin(s) + l;
      table->set_layer_generations(s, l, head.layer_ends[layer] - head.first_generation(layer) + 1);
    }
  }
  for (std::uint32_t c = 0; c < index.cells.size(); ++c) set_segments(head, index, c, *table);
  table->set_base(head.base.triangles.size(), 0);
  table->set_origin(middle_of(head.grid));
  if (Result<void> errors = table->check_errors(); !errors) return tl::unexpected(with_context(errors.error(), name));
  return table;
}

void learn_children(const AssetHead& head, const AssetIndex& index, std::uint32_t parent, CellTable& table) {
  set_page(head, index, parent, table);
  const CellEntry& entry = index.cells[parent];
  for (std::uint32_t c = entry.first_child; c < entry.first_child + entry.child_count; ++c) {
    set_segments(head, index, c, table);
  }
}

}  // namespace fanstream
