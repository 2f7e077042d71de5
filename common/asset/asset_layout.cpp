#include "common/asset/asset_layout.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <xxhash.h>

#include "common/coding/base_coder.h"
#include "common/coding/next_split.h"
#include "common/coding/residual_tables.h"
#include "common/fans/linked_fans.h"

namespace fanstream {
namespace {

constexpr std::uint32_t kMagic = 0x4E415346U;  // "FSAN"

}  // namespace

double error_from_code(std::uint8_t code, double step) { return code == 0 ? 0.0 : step * std::exp2(code / 4.0 - 4.0); }

std::uint8_t code_of_error(double error, double step) {
  if (!(error > 0.0)) return 0;
  return static_cast<std::uint8_t>(std::clamp(std::ceil(4.0 * (std::log2(error / step) + 4.0)), 1.0, 255.0));
}

std::uint32_t block_checksum(std::span<const std::byte> block) {
  return static_cast<std::uint32_t>(XXH3_64bits(block.data(), block.size()));
}

Digest content_digest(std::span<const std::byte> content) {
  XXH128_canonical_t canonical;
  XXH128_canonicalFromHash(&canonical, XXH3_128bits(content.data(), content.size()));
  Digest digest;
  std::copy(std::begin(canonical.digest), std::end(canonical.digest), digest.begin());
  return digest;
}

void write_preamble(const AssetPreamble& preamble, ByteWriter& out) {
  out.u32(kMagic);
  out.u32(kAssetVersion);
  out.u64(preamble.head_bytes);
  out.u64(preamble.index_bytes);
  out.u64(preamble.segment_bytes);
  for (const std::uint8_t byte : preamble.digest) out.u8(byte);
}

Result<AssetPreamble> read_preamble(std::span<const std::byte> data, const std::string& name) {
  ByteReader in(data);
  AssetPreamble preamble;
  const std::uint32_t magic = in.u32();
  const std::uint32_t version = in.u32();
  preamble.head_bytes = in.u64();
  preamble.index_bytes = in.u64();
  preamble.segment_bytes = in.u64();
  for (std::uint8_t& byte : preamble.digest) byte = in.u8();
  if (in.failed()) return fail(ErrorKind::bad_input, name + ": cut short at byte " + std::to_string(data.size()) + ", a Fanstream asset has at least 48");
  if (magic != kMagic) return fail(ErrorKind::bad_input, name + ": not a Fanstream asset (wrong first four bytes)");
  if (version != kAssetVersion) {
    return fail(ErrorKind::unsupported, name + ": asset version " + std::to_string(version) + ", this program reads version " +
                                            std::to_string(kAssetVersion) + "; build the asset again");
  }
  constexpr std::uint64_t kMost = 1ULL << 40U;
  if (preamble.head_bytes < kPreambleBytes || preamble.head_bytes > kMost || preamble.index_bytes > kMost ||
      preamble.segment_bytes > kMost) {
    return fail(ErrorKind::bad_input, name + ": impossible section sizes at byte 8");
  }
  return preamble;
}

std::vector<std::byte> assemble_file(AssetPreamble sizes, std::span<const std::byte> content) {
  sizes.digest = content_digest(content);
  ByteWriter file;
  write_preamble(sizes, file);
  file.bytes(content);
  for (; !content.empty(); content = content.subspan(std::min(content.size(), kBlockBytes))) {
    file.u32(block_checksum(content.first(std::min(content.size(), kBlockBytes))));
  }
  return file.take();
}

void write_head(const AssetHead& head, std::span<const std::byte> coded_base, ByteWriter& out) {
  out.varint(head.vertex_count);
  out.varint(head.triangle_count);
  out.varint(head.component_count);
  head.grid.write(out);
  out.u8(static_cast<std::uint8_t>(head.layer_ends.size()));
  for (const std::uint8_t end : head.layer_ends) out.u8(end);
  out.u8(static_cast<std::uint8_t>(head.slab_ends.size()));
  for (const std::uint8_t end : head.slab_ends) out.u8(end);
  out.varint(head.root_cell_count);
  head.statistics.write(out);
  out.varint(coded_base.size());
  out.bytes(coded_base);
  if (head.polygon_bytes != 0) out.varint(head.polygon_bytes);
}

namespace {

// Ends that rise strictly to `most` at the last.
bool rises(const std::vector<std::uint8_t>& ends, std::size_t most) {
  for (std::size_t i = 0; i < ends.size(); ++i) {
    if (ends[i] == 0 || (i > 0 && ends[i] <= ends[i - 1])) return false;
  }
  return ends.empty() || ends.back() <= most;
}

Result<void> read_layers(ByteReader& in, AssetHead& head, const std::string& name) {
  head.layer_ends.resize(in.u8());
  for (std::uint8_t& end : head.layer_ends) end = in.u8();
  head.slab_ends.resize(in.u8());
  for (std::uint8_t& end : head.slab_ends) end = in.u8();
  head.root_cell_count = static_cast<std::uint32_t>(std::min<std::uint64_t>(in.varint(), 0xFFFFFFFFU));
  const bool layers_used = head.slab_ends.empty() ? head.layer_ends.empty() : head.slab_ends.back() == head.layer_ends.size();
  if (in.failed() || !rises(head.layer_ends, kMostGenerations) || !rises(head.slab_ends, head.layer_ends.size()) || !layers_used) {
    return tl::unexpected(in.error(name, "impossible layers"));
  }
  return {};
}

}  // namespace

Result<AssetHead> read_head(std::span<const std::byte> bytes, const std::string& name) {
  ByteReader in(bytes);
  in.bytes(kPreambleBytes);
  AssetHead head;
  const std::uint64_t vertices = in.varint();
  const std::uint64_t triangles = in.varint();
  const std::uint64_t components = in.varint();
  if (in.failed() || vertices < 3 || vertices > kMostVertices || triangles == 0 || triangles > 4ULL * kMostVertices ||
      components == 0 || components > vertices) {
    return tl::unexpected(in.error(name, "impossible counts"));
  }
  head.vertex_count = static_cast<std::uint32_t>(vertices);
  head.triangle_count = static_cast<std::uint32_t>(triangles);
  head.component_count = static_cast<std::uint32_t>(components);
  Result<PositionGrid> grid = PositionGrid::read(in);
  if (!grid) return tl::unexpected(with_context(grid.error(), name));
  head.grid = std::move(*grid);
  if (Result<void> layers = read_layers(in, head, name); !layers) return tl::unexpected(layers.error());
  const std::size_t statistics_at = in.position();
  Result<SplitStatistics> statistics = SplitStatistics::read(in);
  if (!statistics) return tl::unexpected(with_context(statistics.error(), name));
  head.statistics = *statistics;
  head.statistics_bytes = static_cast<std::uint32_t>(in.position() - statistics_at);
  const std::uint64_t base_bytes = in.varint();
  if (in.failed() || base_bytes > in.remaining()) return tl::unexpected(in.error(name, "FM0 does not fit the head"));
  head.base_bytes = static_cast<std::uint32_t>(base_bytes);
  const std::span<const std::byte> coded_base = in.bytes(static_cast<std::size_t>(base_bytes));
  if (in.remaining() != 0) {
    const std::uint64_t polygon_bytes = in.varint();
    if (in.failed() || in.remaining() != 0 || polygon_bytes == 0 || polygon_bytes > kMostPolygonBytes) {
      return tl::unexpected(in.error(name, "impossible size of the polygon section"));
    }
    head.polygon_bytes = static_cast<std::uint32_t>(polygon_bytes);
  }
  Result<BaseMesh> base = decode_base(coded_base, head.vertex_count);
  if (!base) return tl::unexpected(with_context(base.error(), name + ": FM0"));
  head.base = std::move(*base);
  for (const GridPoint& place : head.base.places) {
    if (!head.grid.contains(place)) return fail(ErrorKind::bad_input, name + ": FM0 has a vertex off the grid");
  }
  if ((head.root_cell_count == 0) != head.layer_ends.empty() || head.root_cell_count > head.base.places.size()) {
    return fail(ErrorKind::bad_input, name + ": impossible number of cells for FM0");
  }
  return head;
}

namespace {

// Numbers of the cell table are coded as differences from what is expected of them, each kind with a running mean and spread
// of its own. Written once for both directions.
class RunningNumber {
 public:
  RunningNumber(float mean, float spread) : mean_(mean), spread_(spread) {}
  // Of a number that is mostly about `per` times the mean.
  template <class Coder>
  std::int32_t code(Coder& coder, std::int32_t value, float per = 1.0F) {
    const float expected = mean_ * per;
    const std::int32_t coded = ResidualTables::instance().code(coder, expected, spread_ * spread_, value);
    const float error = static_cast<float>(coded) - expected;
    mean_ += 0.125F * (error / per);
    spread_ += 0.125F * (1.3F * std::fabs(error) - spread_);
    if (spread_ < 0.25F) spread_ = 0.25F;
    return coded;
  }

 private:
  float mean_;
  float spread_;
};

constexpr std::int32_t kMostSegmentWords = 0xFFFFFF;

// One slab's cells in order. `code(cell)` of a decoder fills the cell; false if a number is impossible.
class CellTableCoder {
 public:
  CellTableCoder(const AssetHead& head, std::uint32_t slab)
      : layers_(head.slab_ends[slab] - head.layer_begin(slab)),
        parents_(slab + 1 < head.slab_ends.size()),
        sizes_(layers_, RunningNumber(0.5F, 4.0F)),
        falls_(layers_, RunningNumber(4.0F, 4.0F)) {}

  // `before`: the parent's last error code, 0 in slab 0.
  template <class Coder>
  bool code(Coder& coder, std::int32_t before, CellEntry& cell, std::span<SegmentEntry> segments) {
    const std::int32_t splits = splits_.code(coder, static_cast<std::int32_t>(cell.split_count));
    const std::int32_t children = parents_ ? children_.code(coder, static_cast<std::int32_t>(cell.child_count)) : 0;
    if (splits < 0 || children < 0) return false;
    cell.split_count = static_cast<std::uint32_t>(splits);
    cell.child_count = static_cast<std::uint32_t>(children);
    if (splits > 0 && !code_cone_of(coder, cell.cone)) return false;
    for (std::size_t s = 0; s < segments.size(); ++s) {
      SegmentEntry& segment = segments[s];
      if (splits > 0) {
        const std::int32_t size =
            sizes_[s].code(coder, static_cast<std::int32_t>(segment.size_bytes / 2), static_cast<float>(splits));
        if (size < 0 || size > kMostSegmentWords) return false;
        segment.size_bytes = 2 * static_cast<std::uint32_t>(size);
      }
      const std::int32_t error = before - falls_[s].code(coder, before - segment.error_code);
      if (error < 0 || error > 255) return false;
      segment.error_code = static_cast<std::uint8_t>(error);
      before = error;
    }
    return true;
  }

 private:
  // The axis as its difference from the last one.
  template <class Coder>
  bool code_cone_of(Coder& coder, CodedCone& cone) {
    const std::int32_t width = widths_.code(coder, cone.width);
    if (width < 0 || width > CodedCone::kWidest) return false;
    cone.width = static_cast<std::uint8_t>(width);
    if (width == 0) return cone = {}, true;
    const std::int32_t u = cone_.u + u_.code(coder, std::int32_t{cone.u} - cone_.u);
    const std::int32_t v = cone_.v + v_.code(coder, std::int32_t{cone.v} - cone_.v);
    if (u < 0 || u >= CodedCone::kPlaces || v < 0 || v >= CodedCone::kPlaces) return false;
    cone.u = static_cast<std::uint8_t>(u);
    cone.v = static_cast<std::uint8_t>(v);
    cone_ = cone;
    return true;
  }

  std::size_t layers_;
  bool parents_;
  CodedCone cone_{1, 8, 8};  // the last one
  RunningNumber widths_{4.0F, 2.0F};
  RunningNumber u_{0.0F, 3.0F};
  RunningNumber v_{0.0F, 3.0F};
  RunningNumber splits_{80.0F, 30.0F};
  RunningNumber children_{3.0F, 1.0F};
  std::vector<RunningNumber> sizes_;
  std::vector<RunningNumber> falls_;
};

// What a cell's first error code is coded against.
std::int32_t error_before(const AssetIndex& index, const CellEntry& cell) {
  if (cell.slab == 0) return 0;
  const CellEntry& parent = index.cells[cell.parent];
  return index.segments[parent.first_segment + parent.segment_count - 1].error_code;
}

}  // namespace

namespace {

// Of the vertices of FM0, in either direction. Nothing without generations.
template <class Coder>
void code_base(Coder& coder, const AssetHead& head, std::vector<std::uint8_t>& next_splits) {
  if (head.generation_count() == 0) return;
  const LinkedFans fans(head.base.places.size(), head.base.triangles);
  code_base_splits(coder, SplitModel(head.statistics), fans, head.generation_count(), next_splits);
}

}  // namespace

void write_index(const AssetIndex& index, const AssetHead& head, ByteWriter& out) {
  std::vector<std::uint8_t> next_splits = index.base_next_splits;
  RansEncoder base;
  code_base(base, head, next_splits);
  const std::vector<std::byte> base_bytes = base.finish();
  out.varint(base_bytes.size());
  out.bytes(base_bytes);
  for (std::size_t first = 0; first < index.cells.size();) {
    const std::uint32_t slab = index.cells[first].slab;
    CellTableCoder coding(head, slab);
    RansEncoder encoder;
    std::size_t end = first;
    for (; end < index.cells.size() && index.cells[end].slab == slab; ++end) {
      CellEntry cell = index.cells[end];
      std::vector<SegmentEntry> segments(index.segments.begin() + cell.first_segment,
                                         index.segments.begin() + cell.first_segment + cell.segment_count);
      coding.code(encoder, error_before(index, cell), cell, segments);
    }
    const std::vector<std::byte> bytes = encoder.finish();
    out.varint(bytes.size());
    out.bytes(bytes);
    first = end;
  }
}

namespace {

class IndexReader {
 public:
  IndexReader(std::span<const std::byte> bytes, const AssetHead& head, const std::string& name)
      : in_(bytes), head_(head), name_(name) {}

  Result<AssetIndex> read(const AssetPreamble& preamble) {
    if (Result<void> base = read_base(); !base) return tl::unexpected(base.error());
    std::uint64_t slab_cells = head_.root_cell_count;
    std::uint32_t slab_first = 0;
    for (std::uint32_t slab = 0; slab < head_.slab_ends.size(); ++slab) {
      if (slab > 0) slab_cells = count_children(slab_first);
      // Every cell holds a vertex of its own.
      if (slab_cells > head_.vertex_count) return tl::unexpected(in_.error(name_, "more cells than vertices"));
      const auto first = static_cast<std::uint32_t>(index_.cells.size());
      index_.cells.resize(first + slab_cells);
      if (slab > 0) adopt_children(slab_first, first);
      slab_first = first;
      if (Result<void> cells = read_slab(slab, first); !cells) return tl::unexpected(cells.error());
    }
    if (in_.remaining() != 0) return tl::unexpected(in_.error(name_, "bytes left over"));
    if (vertices_ + head_.base.places.size() != head_.vertex_count) {
      return fail(ErrorKind::bad_input, name_ + ": base vertices and splits do not add up to the vertex count");
    }
    return place_segments(preamble);
  }

 private:
  Result<void> read_base() {
    const std::uint64_t size = in_.varint();
    if (in_.failed() || size > in_.remaining()) return tl::unexpected(in_.error(name_, "cut short"));
    RansDecoder decoder(in_.bytes(static_cast<std::size_t>(size)));
    index_.base_next_splits.assign(head_.base.places.size(), kNeverSplit);
    code_base(decoder, head_, index_.base_next_splits);
    if (!decoder.finished_cleanly()) return tl::unexpected(in_.error(name_, "damaged before"));
    return {};
  }

  std::uint64_t count_children(std::uint32_t slab_first) const {
    std::uint64_t total = 0;
    for (std::size_t p = slab_first; p < index_.cells.size(); ++p) total += index_.cells[p].child_count;
    return total;
  }

  void adopt_children(std::uint32_t parents_first, std::uint32_t parents_end) {
    std::uint32_t child = parents_end;
    for (std::uint32_t p = parents_first; p < parents_end; ++p) {
      index_.cells[p].first_child = child;
      for (std::uint32_t i = 0; i < index_.cells[p].child_count; ++i) index_.cells[child++].parent = p;
    }
  }

  Result<void> read_slab(std::uint32_t slab, std::uint32_t first) {
    const std::uint64_t size = in_.varint();
    if (in_.failed() || size > in_.remaining()) return tl::unexpected(in_.error(name_, "cut short"));
    RansDecoder decoder(in_.bytes(static_cast<std::size_t>(size)));
    CellTableCoder coding(head_, slab);
    const std::uint32_t layers = head_.slab_ends[slab] - head_.layer_begin(slab);
    for (std::size_t c = first; c < index_.cells.size(); ++c) {
      CellEntry& cell = index_.cells[c];
      cell.slab = slab;
      cell.first_segment = static_cast<std::uint32_t>(index_.segments.size());
      cell.segment_count = layers;
      index_.segments.resize(index_.segments.size() + layers);
      const bool good = coding.code(decoder, error_before(index_, cell), cell, std::span(index_.segments).last(layers));
      cell.first_vertex = static_cast<VertexId>(head_.base.places.size() + vertices_);
      vertices_ += cell.split_count;
      if (!good || vertices_ > head_.vertex_count || cell.child_count > head_.vertex_count) {
        return fail(ErrorKind::bad_input, name_ + ": impossible numbers for cell " + std::to_string(c));
      }
    }
    if (!decoder.finished_cleanly()) return tl::unexpected(in_.error(name_, "damaged before"));
    return {};
  }

  Result<AssetIndex> place_segments(const AssetPreamble& preamble) {
    std::vector<std::uint64_t> layer_bytes(head_.layer_ends.size() + 1, 0);
    const auto each = [this](auto&& use) {
      for (const CellEntry& cell : index_.cells) {
        for (std::uint32_t s = 0; s < cell.segment_count; ++s) {
          use(head_.layer_begin(cell.slab) + s, index_.segments[cell.first_segment + s]);
        }
      }
    };
    each([&](std::uint32_t layer, const SegmentEntry& segment) { layer_bytes[layer + 1] += segment.size_bytes; });
    for (std::size_t l = 1; l < layer_bytes.size(); ++l) layer_bytes[l] += layer_bytes[l - 1];
    if (layer_bytes.back() + head_.polygon_bytes != preamble.segment_bytes) {
      return fail(ErrorKind::bad_input, name_ + ": segment sizes do not add up to the segment section");
    }
    const std::uint64_t start = preamble.head_bytes + preamble.index_bytes;
    index_.polygons = {start + layer_bytes.back(), head_.polygon_bytes, 0};
    each([&](std::uint32_t layer, SegmentEntry& segment) {
      segment.offset = start + layer_bytes[layer];
      layer_bytes[layer] += segment.size_bytes;
    });
    return std::move(index_);
  }

  ByteReader in_;
  const AssetHead& head_;
  const std::string& name_;
  AssetIndex index_;
  std::uint64_t vertices_ = 0;  // made by the cells so far
};

}  // namespace

Result<AssetIndex> read_index(std::span<const std::byte> index, const AssetPreamble& preamble, const AssetHead& head,
                              const std::string& name) {
  return IndexReader(index, head, name + ": cell table").read(preamble);
}

}  // namespace fanstream
