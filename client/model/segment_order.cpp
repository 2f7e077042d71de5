#include "client/model/segment_order.h"

#include <algorithm>

namespace fanstream {

std::vector<OrderedSegment> order_segments(const AssetHead& head, const AssetIndex& index) {
  std::vector<OrderedSegment> order;
  order.reserve(index.segments.size());
  double vertices_before = static_cast<double>(head.base.places.size());
  std::size_t first_cell = 0;
  for (std::uint32_t slab = 0; slab < head.slab_ends.size(); ++slab) {
    std::size_t end_cell = first_cell;
    double splits = 0.0;
    double bytes = 0.0;
    for (; end_cell < index.cells.size() && index.cells[end_cell].slab == slab; ++end_cell) {
      const CellEntry& cell = index.cells[end_cell];
      splits += cell.split_count;
      for (std::uint32_t s = 0; s < cell.segment_count; ++s) bytes += index.segments[cell.first_segment + s].size_bytes;
    }
    const std::uint32_t layers = head.slab_ends[slab] - head.layer_begin(slab);
    double bytes_so_far = 0.0;
    for (std::uint32_t segment = 0; segment < layers; ++segment) {
      for (std::size_t c = first_cell; c < end_cell; ++c) {
        const std::uint32_t size_bytes = index.segments[index.cells[c].first_segment + segment].size_bytes;
        bytes_so_far += size_bytes;
        const double share = bytes > 0.0 ? bytes_so_far / bytes : 1.0;
        order.push_back({static_cast<std::uint32_t>(c), segment, size_bytes, vertices_before + splits * share});
      }
    }
    vertices_before += splits;
    first_cell = end_cell;
  }
  return order;
}

std::vector<CellRun> wants_for(const std::vector<OrderedSegment>& order, std::size_t end) {
  std::vector<CellPrefix> list;
  list.reserve(std::min(end, order.size()));
  for (std::size_t i = 0; i < std::min(end, order.size()); ++i) list.push_back({order[i].cell, order[i].segment + 1});
  return to_runs(list);
}

}  // namespace fanstream
