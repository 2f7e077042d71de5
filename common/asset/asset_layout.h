// What head and index of an asset say, decoded. The bytes are described in ASSET.md.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/asset/coded_cone.h"
#include "common/asset/segment_source.h"
#include "common/coding/base_coder.h"
#include "common/coding/split_model.h"
#include "common/grid/position_grid.h"
#include "common/mesh/triangle_mesh.h"

namespace fanstream {

inline constexpr std::uint32_t kAssetVersion = 3;
inline constexpr std::uint32_t kMostVertices = 1U << 28;
inline constexpr std::size_t kPreambleBytes = 48;

inline constexpr std::uint64_t kMostPolygonBytes = 1U << 26;  // as much as one segment may have in the protocol
inline constexpr std::size_t kBlockBytes = 16384;  // of the content, for each of which the file ends with a checksum

// The first bytes of every asset: where its three sections lie, and what they add up to.
struct AssetPreamble {
  std::uint64_t head_bytes = 0;  // with the preamble
  std::uint64_t index_bytes = 0;
  std::uint64_t segment_bytes = 0;
  Digest digest{};  // XXH3-128 of the content: all sections, but for the preamble
  std::uint64_t section_bytes() const { return head_bytes + index_bytes + segment_bytes; }
  std::uint64_t block_count() const { return (section_bytes() - kPreambleBytes + kBlockBytes - 1) / kBlockBytes; }
  std::uint64_t file_bytes() const { return section_bytes() + 4 * block_count(); }
};

struct AssetHead {
  std::uint32_t vertex_count = 0;
  std::uint32_t triangle_count = 0;
  std::uint32_t component_count = 0;
  PositionGrid grid;
  // Generations are numbered from 1, coarse to fine. Layer l holds those in (layer_ends[l-1], layer_ends[l]]; slab s holds
  // the layers in [slab_ends[s-1], slab_ends[s]).
  std::vector<std::uint8_t> layer_ends;
  std::vector<std::uint8_t> slab_ends;
  std::uint32_t root_cell_count = 0;  // cells that the base is cut into
  SplitStatistics statistics = SplitStatistics::built_in();
  BaseMesh base;
  std::uint32_t base_bytes = 0;   // of FM0 as coded by Draco
  std::uint32_t statistics_bytes = 0;  // of the coding statistics
  std::uint32_t polygon_bytes = 0;     // of the polygon section at the end of the segments (polygon_section.h), or 0

  std::uint32_t generation_count() const { return layer_ends.empty() ? 0 : layer_ends.back(); }
  std::uint32_t layer_begin(std::uint32_t slab) const { return slab == 0 ? 0 : slab_ends[slab - 1]; }
  std::uint32_t first_generation(std::uint32_t layer) const { return layer == 0 ? 1 : layer_ends[layer - 1] + 1U; }
};

struct SegmentEntry {
  std::uint64_t offset = 0;  // in the file; segments lie by layer, then by cell
  std::uint32_t size_bytes = 0;
  // How far the cell, without this segment, may be off the original; see error_from_code. Never less than for a finer
  // segment of the cell or of its children.
  std::uint8_t error_code = 0;
};

struct CellEntry {
  std::uint32_t parent = 0xFFFFFFFFU;  // none for the cells of slab 0
  std::uint32_t slab = 0;
  std::uint32_t first_child = 0;
  std::uint32_t child_count = 0;
  VertexId first_vertex = 0;  // number of the first vertex that it makes
  std::uint32_t split_count = 0;
  std::uint32_t first_segment = 0;  // one for each layer of its slab
  // Holds the normals of the cell's part of the full model, what looks as there from the cell's start left out.
  CodedCone cone;
  std::uint32_t segment_count = 0;
};

struct AssetIndex {
  std::vector<std::uint8_t> base_next_splits;  // by vertex of FM0: the generation, or kNeverSplit
  std::vector<CellEntry> cells;  // by slab, then by parent
  std::vector<SegmentEntry> segments;  // by cell
  // The polygon section, if size_bytes is not 0. To the protocol it is one more cell, behind the last, of one segment.
  SegmentEntry polygons;
  std::uint32_t polygon_cell() const { return static_cast<std::uint32_t>(cells.size()); }
  bool is_polygons(std::uint32_t cell, std::uint32_t segment) const {
    return cell == cells.size() && segment == 0 && polygons.size_bytes != 0;
  }
  // Precondition: there is such a segment, or is_polygons().
  const SegmentEntry& entry(std::uint32_t cell, std::uint32_t segment) const {
    return cell == cells.size() ? polygons : segments[cells[cell].first_segment + segment];
  }

  // Whether no later segment of the cell has any bytes: its stream ends with this one.
  bool is_last_coded(const CellEntry& cell, std::uint32_t segment) const {
    for (++segment; segment < cell.segment_count; ++segment) {
      if (segments[cell.first_segment + segment].size_bytes != 0) return false;
    }
    return true;
  }
};

// Bounds are coded upwards in quarters of a binary logarithm of grid steps from 2^-4; code 0 is exactly 0.
double error_from_code(std::uint8_t code, double step);
std::uint8_t code_of_error(double error, double step);
Digest content_digest(std::span<const std::byte> content);
std::uint32_t block_checksum(std::span<const std::byte> block);

// `data` is exactly the section; every count is checked before anything is allocated for it. Errors start with `name`.
Result<AssetPreamble> read_preamble(std::span<const std::byte> data, const std::string& name);
Result<AssetHead> read_head(std::span<const std::byte> head, const std::string& name);
Result<AssetIndex> read_index(std::span<const std::byte> index, const AssetPreamble& preamble, const AssetHead& head,
                              const std::string& name);

// The inverse. write_head takes FM0 as coded by encode_base.
void write_preamble(const AssetPreamble& preamble, ByteWriter& out);
void write_head(const AssetHead& head, std::span<const std::byte> coded_base, ByteWriter& out);
void write_index(const AssetIndex& index, const AssetHead& head, ByteWriter& out);

// The whole file: a preamble of these sizes, the content, and the checksums of its blocks.
std::vector<std::byte> assemble_file(AssetPreamble sizes, std::span<const std::byte> content);

}  // namespace fanstream
