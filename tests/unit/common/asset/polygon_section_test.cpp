#include "common/asset/polygon_section.h"

#include <gtest/gtest.h>

#include "common/asset/asset_file.h"
#include "common/coding/base_coder.h"
#include "common/coding/base_places.h"
#include "tests/support/asset_helpers.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/polygon_sources.h"

namespace fanstream {
namespace {

using testing::OpenAsset;
using testing::SeededRandom;

OpenAsset quads() {
  const TriangleMesh torus = testing::make_torus(20, 12);
  const std::vector<std::uint32_t> faces = testing::paired_source_faces(torus);
  BuildOptions options = testing::small_cells();
  options.source_faces = faces;
  return testing::build_and_open(torus, options);
}

TEST(DiagonalContext, NumbersAreAllDifferentAndTheSidesMayBeSwapped) {
  std::vector<int> uses(kDiagonalContexts, 0);
  for (std::uint8_t a = 0; a < 4; ++a) {
    for (std::uint8_t b = 0; b < 4; ++b) {
      for (std::uint8_t longest = 0; longest < 3; ++longest) {
        for (std::uint8_t flatness = 0; flatness < 3; ++flatness) {
          DiagonalContext c;
          c.sides = {static_cast<DiagonalContext::Side>(a), static_cast<DiagonalContext::Side>(b)};
          c.longest = longest;
          c.flatness = flatness;
          ASSERT_LT(c.number(), kDiagonalContexts);
          ++uses[c.number()];
          DiagonalContext swapped = c;
          std::swap(swapped.sides[0], swapped.sides[1]);
          EXPECT_EQ(c.number(), swapped.number());
        }
      }
    }
  }
  for (std::size_t n = 0; n < uses.size(); ++n) EXPECT_TRUE(uses[n] == 1 || uses[n] == 2) << n;
}

TEST(PolygonSection, IsReadAsItWasWritten) {
  const OpenAsset asset = quads();
  SeededRandom random(4);
  for (int round = 0; round < 50; ++round) {
    PolygonSection section;
    section.quads = random.below(asset.head->triangle_count / 2);
    section.larger = random.below(asset.head->triangle_count / 3);
    for (std::uint8_t& level : section.statistics.levels) {
      if (random.one_in(3)) level = static_cast<std::uint8_t>(random.below(32));
    }
    for (std::uint32_t b = 0; b < polygon_block_count(*asset.index); ++b) {
      for (std::uint32_t words = random.below(round % 2 == 0 ? 4 : 60); words > 0; --words) {
        section.coded.push_back(static_cast<std::byte>(random.below(256)));
        section.coded.push_back(static_cast<std::byte>(random.below(256)));
      }
      section.ends.push_back(static_cast<std::uint32_t>(section.coded.size()));
    }
    ByteWriter out;
    write_polygons(section, out);
    const Result<PolygonSection> read = read_polygons(out.view(), *asset.head, *asset.index, "asset");
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->quads, section.quads);
    EXPECT_EQ(read->larger, section.larger);
    EXPECT_EQ(read->statistics, section.statistics);
    EXPECT_EQ(read->ends, section.ends);
    EXPECT_EQ(read->coded, section.coded);
    // Cut short anywhere, it is an error.
    const std::size_t cut = random.below(out.size());
    EXPECT_FALSE(read_polygons(std::span(out.view()).first(cut), *asset.head, *asset.index, "asset"));
  }
}

TEST(PolygonSection, ImpossibleCountsAreErrors) {
  const OpenAsset asset = quads();
  ByteWriter out;
  out.varint(asset.head->triangle_count);
  const auto read = read_polygons(out.view(), *asset.head, *asset.index, "asset");
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().kind, ErrorKind::bad_input);
  EXPECT_NE(read.error().message.find("impossible counts"), std::string::npos) << read.error().message;
}

// The size at the end of the head: none, of nothing, too large, more than one, and one that the sections do not add up
// to.
TEST(PolygonSection, TheHeadsSizeOfItIsChecked) {
  const OpenAsset asset = quads();
  const auto head_with = [&](const std::vector<std::uint64_t>& numbers) {
    ByteWriter out;
    AssetHead head = *asset.head;
    head.polygon_bytes = 0;
    write_preamble(asset.preamble, out);
    write_head(head, encode_base(base_on_lattice(head.base, head.precision.lattice(0))).value(), out);
    for (const std::uint64_t number : numbers) out.varint(number);
    return read_head(out.view(), "asset");
  };
  EXPECT_EQ(head_with({})->polygon_bytes, 0U);
  EXPECT_EQ(head_with({17})->polygon_bytes, 17U);
  EXPECT_EQ(head_with({kMostPolygonBytes})->polygon_bytes, kMostPolygonBytes);
  for (const std::vector<std::uint64_t>& wrong :
       std::vector<std::vector<std::uint64_t>>{{0}, {kMostPolygonBytes + 1}, {17, 0}, {std::uint64_t{1} << 62U}}) {
    const auto head = head_with(wrong);
    ASSERT_FALSE(head);
    EXPECT_NE(head.error().message.find("polygon section"), std::string::npos) << head.error().message;
  }
  AssetHead other = *asset.head;
  ++other.polygon_bytes;
  const auto index = read_whole_index(asset.bytes, asset.preamble, other, "asset");
  ASSERT_FALSE(index);
  EXPECT_NE(index.error().message.find("do not add up"), std::string::npos) << index.error().message;
}

TEST(PolygonSection, ADamagedByteOfItIsFoundWithItsBlock) {
  OpenAsset asset = quads();
  asset.bytes[asset.index->polygon_offset + 3] ^= std::byte{4};
  const auto file = AssetFile::from_memory(asset.bytes, "asset");
  ASSERT_FALSE(file);
  EXPECT_NE(file.error().message.find("the segments"), std::string::npos) << file.error().message;
}

}  // namespace
}  // namespace fanstream
