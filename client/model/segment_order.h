// All segments of an asset, coarse to fine: the order in which they lie in the file and are asked for.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/asset/asset_layout.h"
#include "protocol/runs.h"
#include "protocol/segment_table.h"

namespace fanstream {

struct OrderedSegment {
  std::uint32_t cell = 0;
  std::uint32_t segment = 0;
  std::uint32_t size_bytes = 0;
  std::uint32_t layer = 0;  // kPageLayer for pages, which lie before the last slab's layers
};
inline constexpr std::uint32_t kPageLayer = 0xFFFFFFFFU;

// By layer, then by cell; the polygons, if there are any, last, as a layer of their own. Every prefix of it can be
// refined but for splits that wait for a neighbouring cell. While pages are missing it ends with them; the rest follows
// when they are there.
std::vector<OrderedSegment> order_segments(const AssetHead& head, const AssetIndex& index);

// What a session of the protocol needs to know of the index.
std::shared_ptr<SegmentTable> segment_table(const AssetIndex& index);
// Tells the table of a cell's children, which the index has come to know.
void learn_children(const AssetIndex& index, std::uint32_t parent, SegmentTable& table);

// What to ask for to get segments [0, end) in this order, those already held left out by the server.
std::vector<CellRun> wants_for(const std::vector<OrderedSegment>& order, std::size_t end);

}  // namespace fanstream
