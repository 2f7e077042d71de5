#include "common/asset/polygon_section.h"

#include "common/coding/rans.h"
#include "common/coding/residual_tables.h"

namespace fanstream {
namespace {

constexpr std::int32_t kMostBlockWords = 0xFFFFFF;

// Statistics and sizes, in either direction; sizes as differences from a running mean. False if one is impossible.
template <class Coder>
bool code_sizes(Coder& coder, DiagonalStatistics& statistics, std::span<std::int32_t> words) {
  statistics.code(coder);
  float mean = 5.0F;
  float spread = 3.0F;
  for (std::int32_t& size : words) {
    size = ResidualTables::instance().code(coder, mean, spread * spread, size);
    if (size < 0 || size > kMostBlockWords) return false;
    const float error = static_cast<float>(size) - mean;
    mean += 0.125F * error;
    spread += 0.125F * (1.3F * (error < 0.0F ? -error : error) - spread);
    if (spread < 0.25F) spread = 0.25F;
  }
  return true;
}

}  // namespace

std::uint32_t first_polygon_cell(const AssetIndex& index) {
  if (index.cells.empty()) return 0;
  const std::uint32_t last_slab = index.cells.back().slab;
  std::size_t first = index.cells.size();
  while (first > 0 && index.cells[first - 1].slab == last_slab) --first;
  return static_cast<std::uint32_t>(first);
}

std::uint32_t polygon_block_count(const AssetIndex& index) {
  if (index.cells.empty()) return 1;
  return static_cast<std::uint32_t>(index.cells.size()) - first_polygon_cell(index);
}

void write_polygons(const PolygonSection& section, ByteWriter& out) {
  out.varint(section.quads);
  out.varint(section.larger);
  DiagonalStatistics statistics = section.statistics;
  std::vector<std::int32_t> words(section.ends.size());
  for (std::uint32_t b = 0; b < words.size(); ++b) {
    words[b] = static_cast<std::int32_t>(section.block(b).size() / 2);
  }
  RansEncoder encoder;
  code_sizes(encoder, statistics, words);
  const std::vector<std::byte> sizes = encoder.finish();
  out.varint(sizes.size());
  out.bytes(sizes);
  out.bytes(section.coded);
}

Result<PolygonSection> read_polygons(std::span<const std::byte> bytes, const AssetHead& head, const AssetIndex& index,
                                     const std::string& section_of) {
  const std::string name = section_of + ": polygons";
  ByteReader in(bytes);
  PolygonSection section;
  section.quads = in.varint();
  section.larger = in.varint();
  // Each takes two triangles, or three.
  if (in.failed() || section.quads > head.triangle_count / 2 || section.larger > head.triangle_count / 3) {
    return tl::unexpected(in.error(name, "impossible counts"));
  }
  const std::uint64_t size = in.varint();
  if (in.failed() || size > in.remaining()) return tl::unexpected(in.error(name, "cut short"));
  RansDecoder decoder(in.bytes(static_cast<std::size_t>(size)));
  std::vector<std::int32_t> words(polygon_block_count(index));
  if (!code_sizes(decoder, section.statistics, words) || !decoder.finished_cleanly()) {
    return tl::unexpected(in.error(name, "damaged before"));
  }
  std::uint64_t end = 0;
  for (const std::int32_t w : words) {
    end += 2 * static_cast<std::uint64_t>(w);
    if (end > in.remaining()) return tl::unexpected(in.error(name, "sizes of blocks do not add up"));
    section.ends.push_back(static_cast<std::uint32_t>(end));
  }
  if (end != in.remaining()) return tl::unexpected(in.error(name, "sizes of blocks do not add up"));
  const std::span<const std::byte> coded = in.bytes(in.remaining());
  section.coded.assign(coded.begin(), coded.end());
  return section;
}

}  // namespace fanstream
