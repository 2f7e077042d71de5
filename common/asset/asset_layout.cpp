#include "common/asset/asset_layout.h"

#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/coding/base_places.h"
#include "common/coding/next_split.h"

namespace fanstream {
namespace {

constexpr std::uint32_t kMagic = 0x4E415346U;  // "FSAN"

}  // namespace

double error_from_code(std::uint8_t code, double step) { return code == 0 ? 0.0 : step * std::exp2(code / 8.0 - 4.0); }

std::uint8_t code_of_error(double error, double step) {
  if (!(error > 0.0)) return 0;
  return static_cast<std::uint8_t>(std::clamp(std::ceil(8.0 * (std::log2(error / step) + 4.0)), 1.0, 255.0));
}

bool is_believable(std::uint64_t vertices, std::uint64_t section_bytes) {
  constexpr std::uint64_t kWithoutQuestion = 1U << 16U;
  constexpr std::uint64_t kMostPerByte = 64;
  return vertices <= kWithoutQuestion || (vertices - kWithoutQuestion) / kMostPerByte <= section_bytes;
}

Result<void> check_index_size(std::uint64_t cells, std::uint64_t segments) {
  if (cells <= kMostCells && segments <= kMostSegments) return {};
  return fail(ErrorKind::limit, "more than " + std::to_string(kMostCells) + " cells or " +
                                    std::to_string(kMostSegments) + " segments; build it with larger cells");
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
  if (in.failed())
    return fail(ErrorKind::bad_input,
                name + ": cut short at byte " + std::to_string(data.size()) + ", a Fanstream asset has at least 48");
  if (magic != kMagic) return fail(ErrorKind::bad_input, name + ": not a Fanstream asset (wrong first four bytes)");
  if (version != kAssetVersion) {
    return fail(ErrorKind::unsupported, name + ": asset version " + std::to_string(version) +
                                            ", this program reads version " + std::to_string(kAssetVersion) +
                                            "; build the asset again");
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

namespace {

// A bit for each generation but the last, whether a layer ends with it; likewise for layers and slabs.
void write_layers(const AssetHead& head, ByteWriter& out) {
  out.u8(static_cast<std::uint8_t>(head.generation_count()));
  if (head.layer_ends.empty()) return;
  out.varint(head.root_cell_count);
  const auto write_ends = [](const std::vector<std::uint8_t>& ends, BitWriter& bits) {
    for (std::uint32_t i = 1; i < ends.back(); ++i) bits.bit(std::find(ends.begin(), ends.end(), i) != ends.end());
  };
  BitWriter bits(out);
  write_ends(head.layer_ends, bits);
  write_ends(head.slab_ends, bits);
  bits.bit(head.has_pages);
  head.precision.write(bits);
  bits.finish();
}

}  // namespace

void write_head(const AssetHead& head, std::span<const std::byte> coded_base, ByteWriter& out) {
  out.varint(head.vertex_count);
  out.varint(head.triangle_count);
  out.varint(head.component_count);
  head.grid.write(out);
  write_layers(head, out);
  head.statistics.write(out);
  if (!head.precision.is_exact()) {
    const auto exact = encode_exact_places(head.base.places, head.exact_base, head.precision.lattice(0));
    out.varint(exact.size());
    out.bytes(exact);
  }
  out.varint(coded_base.size());
  out.bytes(coded_base);
  if (head.polygon_bytes != 0) out.varint(head.polygon_bytes);
}

namespace {

Result<void> read_layers(ByteReader& in, AssetHead& head, const std::string& name) {
  const std::uint32_t generations = in.u8();
  if (in.failed() || generations > kMostGenerations) return tl::unexpected(in.error(name, "impossible layers"));
  if (generations == 0) {
    head.precision = PlacePrecision({}, head.grid);
    return {};
  }
  head.root_cell_count = static_cast<std::uint32_t>(std::min<std::uint64_t>(in.varint(), 0xFFFFFFFFU));
  BitReader bits(in);
  const auto read_ends = [&](std::uint32_t last) {
    std::vector<std::uint8_t> ends;
    for (std::uint32_t i = 1; i <= last; ++i) {
      if (i == last || bits.bit()) ends.push_back(static_cast<std::uint8_t>(i));
    }
    return ends;
  };
  head.layer_ends = read_ends(generations);
  head.slab_ends = read_ends(static_cast<std::uint32_t>(head.layer_ends.size()));
  head.has_pages = bits.bit();
  if (in.failed() || (head.has_pages && head.slab_ends.size() < 2)) {
    return tl::unexpected(in.error(name, "impossible layers"));
  }
  Result<PlacePrecision> precision = PlacePrecision::read(bits, head.grid, generations);
  if (!precision) return tl::unexpected(with_context(precision.error(), name));
  head.precision = *precision;
  return {};
}

Result<void> read_base(std::span<const std::byte> coded, std::span<const std::byte> exact, AssetHead& head,
                       const std::string& name) {
  Result<BaseMesh> base = decode_base(coded, head.vertex_count);
  if (!base) return tl::unexpected(with_context(base.error(), name + ": FM0"));
  head.base = std::move(*base);
  const auto off_the_grid = [&] { return fail(ErrorKind::bad_input, name + ": FM0 has a vertex off the grid"); };
  if (!head.precision.is_exact()) {
    const PlaceLattice& lattice = head.precision.lattice(0);
    for (const GridPoint& point : head.base.places) {
      if (!lattice.contains(point)) return off_the_grid();
    }
    Result<std::vector<std::uint8_t>> flags = decode_exact_places(exact, lattice, head.base.places);
    if (!flags) return tl::unexpected(with_context(flags.error(), name + ": FM0"));
    head.exact_base = std::move(*flags);
  }
  for (const GridPoint& place : head.base.places) {
    if (!head.grid.contains(place)) return off_the_grid();
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
  const auto sized = [&] {
    return in.bytes(static_cast<std::size_t>(std::min<std::uint64_t>(in.varint(), bytes.size())));
  };
  const std::span<const std::byte> exact = head.precision.is_exact() ? std::span<const std::byte>() : sized();
  const std::span<const std::byte> coded_base = sized();
  if (in.failed()) return tl::unexpected(in.error(name, "FM0 does not fit the head"));
  head.base_bytes = static_cast<std::uint32_t>(coded_base.size());
  if (in.remaining() != 0) {
    const std::uint64_t polygon_bytes = in.varint();
    if (in.failed() || in.remaining() != 0 || polygon_bytes == 0 || polygon_bytes > kMostPolygonBytes) {
      return tl::unexpected(in.error(name, "impossible size of the polygon section"));
    }
    head.polygon_bytes = static_cast<std::uint32_t>(polygon_bytes);
  }
  if (Result<void> base = read_base(coded_base, exact, head, name); !base) return tl::unexpected(base.error());
  if ((head.root_cell_count == 0) != head.layer_ends.empty() || head.root_cell_count > head.base.places.size()) {
    return fail(ErrorKind::bad_input, name + ": impossible number of cells for FM0");
  }
  return head;
}

}  // namespace fanstream
