// What head and index of an asset say, decoded. The bytes are described in ASSET.md.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/asset/coded_cone.h"
#include "common/asset/segment_source.h"
#include "common/coding/base_coder.h"
#include "common/coding/place_precision.h"
#include "common/coding/split_model.h"
#include "common/grid/position_grid.h"
#include "common/mesh/triangle_mesh.h"

namespace fanstream {

inline constexpr std::uint32_t kAssetVersion = 8;
inline constexpr std::uint32_t kMostVertices = 1U << 28;
inline constexpr std::uint32_t kMostCells = 1U << 22;
inline constexpr std::uint32_t kMostSegments = 1U << 26;  // of all cells together; a client takes 16 bytes for each
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
  // Generations are numbered from 1, coarse to fine. Layer l holds those in (layer_ends[l-1], layer_ends[l]]; slab s
  // holds the layers in [slab_ends[s-1], slab_ends[s]).
  std::vector<std::uint8_t> layer_ends;
  std::vector<std::uint8_t> slab_ends;
  std::uint32_t root_cell_count = 0;  // cells that the base is cut into
  bool has_pages = false;  // the cells of the last slab are not in the index but told by pages, one for each parent
  PlacePrecision precision;
  SplitStatistics statistics = SplitStatistics::built_in();
  BaseMesh base;  // with the places that are shown
  // By vertex of FM0, 1 for those that are never split, whose places are exact. Empty where all are.
  std::vector<std::uint8_t> exact_base;
  std::uint32_t base_bytes = 0;        // of FM0 as coded by Draco
  std::uint32_t statistics_bytes = 0;  // of the coding statistics
  std::uint32_t polygon_bytes = 0;     // of the polygon section at the end of the segments (polygon_section.h), or 0

  std::uint32_t generation_count() const { return layer_ends.empty() ? 0 : layer_ends.back(); }
  std::uint32_t layer_begin(std::uint32_t slab) const { return slab == 0 ? 0 : slab_ends[slab - 1]; }
  std::uint32_t first_generation(std::uint32_t layer) const { return layer == 0 ? 1 : layer_ends[layer - 1] + 1U; }
  std::uint32_t slab_count() const { return static_cast<std::uint32_t>(slab_ends.size()); }
  std::uint32_t layers_of(std::uint32_t slab) const { return slab_ends[slab] - layer_begin(slab); }
};

inline constexpr std::uint32_t kUnknownBytes = 0xFFFFFFFFU;

struct SegmentEntry {
  std::uint32_t size_bytes = 0;  // kUnknownBytes before the cell is known
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
  // Of the cells of the slab before the last, where there are pages, and 0 elsewhere: what is known of the children
  // before the cell's page is. The page counts as one more segment of the cell, after its others; it is empty, or not
  // needed, where there are no children.
  std::uint32_t page_bytes = 0;
  std::uint32_t child_splits = 0;  // of all children
  std::uint8_t rest_code = 0;      // error code of the complete cell: the largest that a child begins with
  std::uint64_t page_offset = 0;   // in the file
};

// From where the running numbers of a page start: means and spreads over the whole slab, in 16ths.
struct PageStarts {
  struct Number {
    std::uint32_t mean = 0, spread = 0;
  };
  Number splits, widths, axes;       // the means of splits and axes are 0
  std::vector<Number> sizes, falls;  // by layer
};

// Where there are pages, the cells of the last slab exist from the start, with their places in the tree; the rest of
// them, and their segments, become known with their parents' pages (read_page).
struct AssetIndex {
  std::vector<std::uint8_t> base_next_splits;  // by vertex of FM0: the generation, or kNeverSplit
  std::vector<CellEntry> cells;                // by slab, then by parent
  std::vector<SegmentEntry> segments;          // by cell
  // By segment: where it lies in the file, by layer, then by cell. Of cells told by pages it is known when all pages
  // are. Empty where it has been forgotten.
  std::vector<std::uint64_t> segment_offsets;
  // The polygon section, if size_bytes is not 0. To the protocol it is one more cell, behind the last, of one segment.
  SegmentEntry polygons;
  std::uint64_t polygon_offset = 0;  // in the file
  std::uint32_t polygon_cell() const { return static_cast<std::uint32_t>(cells.size()); }
  bool is_polygons(std::uint32_t cell, std::uint32_t segment) const {
    return cell == cells.size() && segment == 0 && polygons.size_bytes != 0;
  }
  PageStarts page_starts;
  std::uint32_t first_paged = 0xFFFFFFFFU;       // the first cell that pages tell of
  std::uint32_t first_page_owner = 0xFFFFFFFFU;  // the first cell that has a page
  std::uint32_t unknown_pages = 0;
  std::uint64_t paged_offset = 0, paged_end = 0;  // where the segments of those cells lie in the file
  std::uint64_t paged_known_bytes = 0;            // of those that are known

  // Whether its numbers are known, and not only that it exists.
  bool is_known(std::uint32_t cell) const {
    return cells[cell].segment_count == 0 || segments[cells[cell].first_segment].size_bytes != kUnknownBytes;
  }
  bool has_page(std::uint32_t cell) const { return cell >= first_page_owner && cell < first_paged; }
  bool is_page(std::uint32_t cell, std::uint32_t piece) const {
    return has_page(cell) && piece == cells[cell].segment_count;
  }
  bool knows_children(std::uint32_t cell) const {
    return cells[cell].child_count == 0 || is_known(cells[cell].first_child);
  }
  // What can be asked for of a cell: its segments, and its page where it has one. Of polygon_cell() the polygons.
  std::uint32_t piece_count(std::uint32_t cell) const {
    if (cell == cells.size()) return polygons.size_bytes != 0 ? 1 : 0;
    return cells[cell].segment_count + (has_page(cell) ? 1U : 0U);
  }
  std::uint32_t piece_bytes(std::uint32_t cell, std::uint32_t piece) const {
    if (cell == cells.size()) return polygons.size_bytes;
    const CellEntry& entry = cells[cell];
    return piece < entry.segment_count ? segments[entry.first_segment + piece].size_bytes : entry.page_bytes;
  }
  // Precondition: offsets have not been forgotten.
  std::uint64_t piece_offset(std::uint32_t cell, std::uint32_t piece) const {
    if (cell == cells.size()) return polygon_offset;
    const CellEntry& entry = cells[cell];
    return piece < entry.segment_count ? segment_offsets[entry.first_segment + piece] : entry.page_offset;
  }

  // Whether no later segment of the cell has any bytes: its stream ends with this one.
  bool is_last_coded(const CellEntry& cell, std::uint32_t segment) const {
    for (++segment; segment < cell.segment_count; ++segment) {
      if (segments[cell.first_segment + segment].size_bytes != 0) return false;
    }
    return true;
  }
};

// Bounds are coded upwards in eighths of a binary logarithm of grid steps from 2^-4; code 0 is exactly 0.
double error_from_code(std::uint8_t code, double step);
std::uint8_t code_of_error(double error, double step);
Digest content_digest(std::span<const std::byte> content);
std::uint32_t block_checksum(std::span<const std::byte> block);

// Whether a model of so many vertices fits that many bytes of head, index and segments. Memory is taken by vertex and
// cell; nothing near an eighth of a bit for each vertex has ever been seen (a flat grid takes 5 bits).
bool is_believable(std::uint64_t vertices, std::uint64_t section_bytes);

// Fails (limit) beyond kMostCells and kMostSegments.
Result<void> check_index_size(std::uint64_t cells, std::uint64_t segments);

// `data` is exactly the section; every count is checked before anything is allocated for it. Errors start with `name`.
// read_index fails (limit) where the preamble's sizes are not believable for the vertices, or there are more cells or
// segments than the most.
Result<AssetPreamble> read_preamble(std::span<const std::byte> data, const std::string& name);
Result<AssetHead> read_head(std::span<const std::byte> head, const std::string& name);
Result<AssetIndex> read_index(std::span<const std::byte> index, const AssetPreamble& preamble, const AssetHead& head,
                              const std::string& name);
// Makes the children of a cell known. A page that is known already is ignored. Fails (bad_input) if the cell has none,
// the page is damaged, or does not say what the cell's entry announces; then nothing becomes known. Precondition: the
// index is of this head.
Result<void> read_page(std::span<const std::byte> page, std::uint32_t cell, const AssetHead& head, AssetIndex& index,
                       const std::string& name);
// The index with all pages, from a file's sections.
Result<AssetIndex> read_whole_index(std::span<const std::byte> sections, const AssetPreamble& preamble,
                                    const AssetHead& head, const std::string& name);

// The inverse. write_head takes FM0 on its lattice as coded by encode_base.
void write_preamble(const AssetPreamble& preamble, ByteWriter& out);
void write_head(const AssetHead& head, std::span<const std::byte> coded_base, ByteWriter& out);
void write_index(const AssetIndex& index, const AssetHead& head, ByteWriter& out);
// Where head.has_pages: sets what cells and index say of pages, and returns them, one behind another. To be called
// before write_index. Precondition: all cells and segments are known.
std::vector<std::byte> write_pages(const AssetHead& head, AssetIndex& index);

// The end of the segment section where there are pages: for each kRangeParents cells that have a page, the bytes of
// their children's segments in each layer, as u32. So who reads a file by byte ranges finds any segment by this table
// and the pages of its own group of parents. Precondition: all cells are known.
inline constexpr std::uint32_t kRangeParents = 32;
std::vector<std::byte> range_table(const AssetHead& head, const AssetIndex& index);
std::uint64_t range_table_bytes(const AssetHead& head, const AssetIndex& index);  // known from the start

// The whole file: a preamble of these sizes, the content, and the checksums of its blocks.
std::vector<std::byte> assemble_file(AssetPreamble sizes, std::span<const std::byte> content);

}  // namespace fanstream
