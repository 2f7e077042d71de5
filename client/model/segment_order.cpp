#include "client/model/segment_order.h"

#include <algorithm>

namespace fanstream {

namespace {

std::vector<std::uint32_t> sizes_of(const AssetIndex& index, std::uint32_t cell) {
  std::vector<std::uint32_t> sizes_bytes(index.piece_count(cell));
  for (std::uint32_t i = 0; i < sizes_bytes.size(); ++i) sizes_bytes[i] = index.piece_bytes(cell, i);
  return sizes_bytes;
}

}  // namespace

std::vector<OrderedSegment> order_segments(const AssetHead& head, const AssetIndex& index) {
  std::vector<OrderedSegment> order;
  order.reserve(index.segments.size());
  std::size_t first_cell = 0;
  for (std::uint32_t slab = 0; slab < head.slab_count(); ++slab) {
    std::size_t end_cell = first_cell;
    while (end_cell < index.cells.size() && index.cells[end_cell].slab == slab) ++end_cell;
    if (first_cell == index.first_paged) {
      for (std::uint32_t c = index.first_page_owner; c < index.first_paged; ++c) {
        order.push_back({c, index.cells[c].segment_count, index.cells[c].page_bytes, kPageLayer});
      }
      if (index.unknown_pages != 0) return order;
    }
    for (std::uint32_t layer = head.layer_begin(slab); layer < head.slab_ends[slab]; ++layer) {
      const std::uint32_t segment = layer - head.layer_begin(slab);
      for (std::size_t c = first_cell; c < end_cell; ++c) {
        const std::uint32_t size_bytes = index.segments[index.cells[c].first_segment + segment].size_bytes;
        order.push_back({static_cast<std::uint32_t>(c), segment, size_bytes, layer});
      }
    }
    first_cell = end_cell;
  }
  if (index.polygons.size_bytes != 0) {
    order.push_back(
        {index.polygon_cell(), 0, index.polygons.size_bytes, static_cast<std::uint32_t>(head.layer_ends.size())});
  }
  return order;
}

std::shared_ptr<SegmentTable> segment_table(const AssetIndex& index) {
  auto table = std::make_shared<SegmentTable>();
  table->reserve(index.cells.size(), index.segments.size());
  for (std::uint32_t c = 0; c < index.cells.size(); ++c) {
    if (index.is_known(c)) {
      table->add_cell(sizes_of(index, c));
    } else {
      table->add_unknown_cell(index.piece_count(c));
    }
  }
  if (index.polygons.size_bytes != 0) table->add_cell(std::vector<std::uint32_t>{index.polygons.size_bytes});
  return table;
}

void learn_children(const AssetIndex& index, std::uint32_t parent, SegmentTable& table) {
  const CellEntry& entry = index.cells[parent];
  for (std::uint32_t c = entry.first_child; c < entry.first_child + entry.child_count; ++c) {
    table.learn_cell(c, sizes_of(index, c));
  }
}

std::vector<CellRun> wants_for(const std::vector<OrderedSegment>& order, std::size_t end) {
  std::vector<CellPrefix> list;
  list.reserve(std::min(end, order.size()));
  for (std::size_t i = 0; i < std::min(end, order.size()); ++i) list.push_back({order[i].cell, order[i].segment + 1});
  return to_runs(list);
}

}  // namespace fanstream
