// The asset's polygons: which edges of the full model lie inside faces of the source file that are no triangles. An
// optional section behind the segments; ASSET.md describes the bytes.
#pragma once

#include "common/asset/asset_layout.h"
#include "common/coding/diagonal_model.h"

namespace fanstream {

// Blocks are the cells of the last slab, in order; without layers there is one, of all vertices.
std::uint32_t polygon_block_count(const AssetIndex& index);
std::uint32_t first_polygon_cell(const AssetIndex& index);  // the cell of block 0; the number of cells if there is none

struct PolygonSection {
  std::uint64_t quads = 0;   // faces of four corners in the full model
  std::uint64_t larger = 0;  // of more
  DiagonalStatistics statistics = DiagonalStatistics::built_in();
  std::vector<std::uint32_t> ends;  // by block: the end of its bytes in `coded`
  std::vector<std::byte> coded;     // of all blocks, one behind another

  std::span<const std::byte> block(std::uint32_t b) const {
    const std::uint32_t begin = b == 0 ? 0 : ends[b - 1];
    return std::span(coded).subspan(begin, ends[b] - begin);
  }
};

void write_polygons(const PolygonSection& section, ByteWriter& out);
// `bytes` is exactly the section. Errors (bad_input) start with `name`. Blocks are not decoded here: SourcePolygons.
Result<PolygonSection> read_polygons(std::span<const std::byte> bytes, const AssetHead& head, const AssetIndex& index,
                                     const std::string& name);

}  // namespace fanstream
