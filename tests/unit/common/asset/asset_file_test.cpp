#include "common/asset/asset_file.h"

#include <gtest/gtest.h>

#include <random>

#include "common/mesh/manifold_check.h"
#include "common/refine/full_mesh.h"
#include "tests/support/small_assets.h"
#include "tests/support/temporary_folder.h"

namespace fanstream {
namespace {

using testing::as_text;
using testing::small_asset;
using testing::TemporaryFolder;

std::vector<std::byte> joined(const AssetFile& asset) {
  std::vector<std::byte> all(asset.head().begin(), asset.head().end());
  all.insert(all.end(), asset.index().begin(), asset.index().end());
  // Segments lie by layer, then by cell.
  std::vector<std::pair<std::uint64_t, std::span<const std::byte>>> segments;
  for (std::uint32_t c = 0; c < asset.cell_count(); ++c) {
    for (std::uint32_t s = 0; s < asset.segment_count(c); ++s) {
      segments.emplace_back(asset.asset_index()->piece_offset(c, s), asset.segment(c, s));
    }
  }
  std::stable_sort(segments.begin(), segments.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& [offset, bytes] : segments) all.insert(all.end(), bytes.begin(), bytes.end());
  const std::vector<std::byte> ranges = range_table(*asset.asset_head(), *asset.asset_index());
  all.insert(all.end(), ranges.begin(), ranges.end());
  return all;
}

std::vector<std::byte> sections_of(const std::vector<std::byte>& file) {
  const AssetPreamble preamble = read_preamble(file, "x.fan").value();
  return {file.begin(), file.begin() + static_cast<std::ptrdiff_t>(preamble.section_bytes())};
}

Error error_of(const std::vector<std::byte>& bytes) {
  const auto opened = AssetFile::from_memory(bytes, "x.fan");
  EXPECT_FALSE(opened.has_value());
  return opened ? Error{} : opened.error();
}

// The same file with another head, and a digest that fits.
std::vector<std::byte> forged(const AssetFile& asset, const AssetHead& head) {
  ByteWriter body;
  write_head(head, asset.head().last(head.base_bytes), body);
  AssetPreamble preamble = asset.preamble();
  preamble.head_bytes = kPreambleBytes + body.size();
  body.bytes(asset.bytes().first(asset.preamble().section_bytes()).subspan(asset.head().size()));
  return assemble_file(preamble, body.view());
}

TEST(AssetFile, HeadIndexAndSegmentsAreTheWholeFileUpToTheChecksums) {
  const TemporaryFolder folder;
  const std::vector<std::byte> bytes = small_asset();
  const auto mapped = AssetFile::open(folder.write("torus.fan", as_text(bytes)));
  ASSERT_TRUE(mapped.has_value()) << mapped.error().message;
  const auto in_memory = AssetFile::from_memory(bytes, "torus");
  ASSERT_TRUE(in_memory.has_value()) << in_memory.error().message;
  EXPECT_EQ(joined(**mapped), sections_of(bytes));
  EXPECT_EQ(joined(**in_memory), sections_of(bytes));
  EXPECT_EQ((*mapped)->preamble().file_bytes(), bytes.size());
  EXPECT_EQ((*mapped)->digest(), (*in_memory)->digest());
  EXPECT_EQ((*mapped)->size_bytes(), bytes.size());
  EXPECT_EQ((*mapped)->vertex_count(), 240U);
  EXPECT_EQ((*mapped)->triangle_count(), 480U);
  EXPECT_GT((*mapped)->cell_count(), 3U);
}

TEST(AssetFile, FullMeshIsTheModel) {
  const TriangleMesh torus = testing::make_torus(20, 12);
  const auto asset = AssetFile::from_memory(small_asset(torus), "torus");
  ASSERT_TRUE(asset.has_value());
  const auto full = load_full(**asset);
  ASSERT_TRUE(full.has_value()) << full.error().message;
  const TriangleMesh mesh = (*full)->triangle_mesh();
  EXPECT_EQ(mesh.positions.size(), torus.positions.size());
  EXPECT_EQ(mesh.triangles.size(), torus.triangles.size());
  EXPECT_TRUE(is_oriented_manifold(mesh));
}

TEST(AssetFile, ReplacedOrDeletedFileStaysReadable) {
  const TemporaryFolder folder;
  const std::vector<std::byte> bytes = small_asset();
  const auto path = folder.write("torus.fan", as_text(bytes));
  const auto asset = AssetFile::open(path);
  ASSERT_TRUE(asset.has_value());
  std::filesystem::remove(path);
  EXPECT_EQ(joined(**asset), sections_of(bytes));
}

TEST(AssetFile, CutShortAnywhereIsAnError) {
  const TemporaryFolder folder;
  const std::vector<std::byte> bytes = small_asset();
  for (std::size_t size = 0; size < bytes.size(); size += 10) {
    SCOPED_TRACE(size);
    const std::vector<std::byte> cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    const auto opened = AssetFile::open(folder.write("cut.fan", as_text(cut)));
    ASSERT_FALSE(opened.has_value());
    EXPECT_EQ(opened.error().kind, ErrorKind::bad_input);
    EXPECT_NE(opened.error().message.find(size == 0 ? "is empty" : "cut short at byte " + std::to_string(size)),
              std::string::npos)
        << opened.error().message;
  }
}

TEST(AssetFile, EveryFlippedByteIsFound) {
  const std::vector<std::byte> bytes = small_asset();
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    SCOPED_TRACE(i);
    std::vector<std::byte> damaged = bytes;
    damaged[i] ^= std::byte{0x10};
    const Error error = error_of(damaged);
    EXPECT_TRUE(error.message.starts_with("x.fan: ")) << error.message;
    EXPECT_TRUE(error.kind == ErrorKind::bad_input || (error.kind == ErrorKind::unsupported && i >= 4 && i < 8));
  }
}

// Several blocks, the last of them shorter.
const std::vector<std::byte>& file_of_blocks() {
  static const std::vector<std::byte> bytes = small_asset(testing::make_terrain(230, 230, 1));
  return bytes;
}

TEST(AssetFile, DamagedBlockIsNamedByItsBytesAndItsSections) {
  const AssetPreamble preamble = read_preamble(file_of_blocks(), "x.fan").value();
  ASSERT_GE(preamble.block_count(), 3U);
  const auto message_of = [&](std::uint64_t place) {
    std::vector<std::byte> bytes = file_of_blocks();
    bytes[place] ^= std::byte{1};
    return error_of(bytes).message;
  };
  for (std::uint64_t block = 0; block < preamble.block_count(); ++block) {
    const std::uint64_t begin = kPreambleBytes + block * kBlockBytes;
    const std::uint64_t end = std::min(begin + kBlockBytes, preamble.section_bytes());
    const std::string range = "in bytes " + std::to_string(begin) + " to " + std::to_string(end - 1) + " (";
    for (const std::uint64_t place : {begin, (begin + end) / 2, end - 1, preamble.section_bytes() + 4 * block + 3}) {
      const std::string message = message_of(place);
      EXPECT_NE(message.find(range), std::string::npos) << message;
      EXPECT_EQ(message.find("the segments") != std::string::npos, end > preamble.head_bytes + preamble.index_bytes);
      EXPECT_EQ(message.find("the head") != std::string::npos, begin < preamble.head_bytes) << message;
    }
  }
  EXPECT_NE(message_of(40).find("in the digest"), std::string::npos);
}

// The digest does not cover the checksums, so that it stays the content's name.
TEST(AssetFile, BlocksAreCheckedOnTheirOwnAndTogether) {
  const AssetPreamble preamble = read_preamble(file_of_blocks(), "x.fan").value();
  const std::span<const std::byte> file = file_of_blocks();
  const auto content = file.first(preamble.section_bytes()).subspan(kPreambleBytes);
  EXPECT_EQ(content_digest(content), preamble.digest);
  EXPECT_EQ(assemble_file(preamble, content), file_of_blocks());
  ByteReader checksums(file.subspan(preamble.section_bytes()));
  for (std::uint64_t at = 0; at < content.size(); at += kBlockBytes) {
    EXPECT_EQ(checksums.u32(), block_checksum(content.subspan(at, std::min(kBlockBytes, content.size() - at))));
  }
  EXPECT_EQ(checksums.remaining(), 0U);
}

TEST(AssetFile, DamagedHeadIsNamed) {
  std::vector<std::byte> bytes = small_asset();
  bytes[kPreambleBytes] = std::byte{0};  // the lowest bits of the vertex count
  const std::string message = error_of(bytes).message;
  EXPECT_NE(message.find("the head"), std::string::npos) << message;
}

// Layers without cells to refine, or with more than FM0 has vertices.
TEST(AssetFile, ImpossibleNumbersOfCellsAreRefused) {
  const auto asset = AssetFile::from_memory(small_asset(), "x.fan");
  ASSERT_TRUE(asset.has_value());
  AssetHead head = *(*asset)->asset_head();
  ASSERT_FALSE(head.layer_ends.empty());
  head.root_cell_count = 0;
  EXPECT_FALSE(AssetFile::from_memory(forged(**asset, head), "x.fan").has_value());
  head.root_cell_count = static_cast<std::uint32_t>(head.base.places.size()) + 1;
  EXPECT_FALSE(AssetFile::from_memory(forged(**asset, head), "x.fan").has_value());
}

TEST(AssetFile, AnotherVersionIsSaidToBeOne) {
  std::vector<std::byte> bytes = small_asset();
  for (const int version : {0, 1, 2, 3, 4, 5, 6, 7, 9, 77}) {  // 7 knew places at rest no better than when they were touched
    bytes[4] = static_cast<std::byte>(version);
    const Error error = error_of(bytes);
    EXPECT_EQ(error.kind, ErrorKind::unsupported);
    EXPECT_NE(error.message.find("version " + std::to_string(version) + ","), std::string::npos) << error.message;
    EXPECT_NE(error.message.find("reads version 8"), std::string::npos) << error.message;
  }
}

TEST(AssetFile, BytesBehindTheEndAreAnError) {
  std::vector<std::byte> bytes = small_asset();
  bytes.push_back(std::byte{0});
  EXPECT_NE(error_of(bytes).message.find("1 bytes follow"), std::string::npos);
}

TEST(AssetFile, WhatIsNoAssetIsToldFromADamagedOne) {
  const TemporaryFolder folder;
  const auto text = AssetFile::open(folder.write("text.fan", "hello, world\n"));
  ASSERT_FALSE(text.has_value());
  EXPECT_NE(text.error().message.find("not a Fanstream asset"), std::string::npos) << text.error().message;
  const auto missing = AssetFile::open(folder.path() / "missing.fan");
  ASSERT_FALSE(missing.has_value());
  EXPECT_EQ(missing.error().kind, ErrorKind::not_found);
  const auto directory = AssetFile::open(folder.path());
  ASSERT_FALSE(directory.has_value());
  EXPECT_EQ(directory.error().kind, ErrorKind::io);
  EXPECT_NE(directory.error().message.find("is a directory"), std::string::npos);
  const auto device = AssetFile::open("/dev/null");
  ASSERT_FALSE(device.has_value());
  EXPECT_EQ(device.error().kind, ErrorKind::io);
}

// A small file must not make its reader take gigabytes.
TEST(AssetFile, VertexCountOutOfProportionIsRefused) {
  const auto asset = AssetFile::from_memory(small_asset(), "x.fan");
  ASSERT_TRUE(asset.has_value());
  AssetHead head = *(*asset)->asset_head();
  head.vertex_count = kMostVertices;
  const Error error = error_of(forged(**asset, head));
  EXPECT_EQ(error.kind, ErrorKind::limit) << error.message;
}

// Sections that are rewritten with a fitting digest and checksums, as an attacker would: errors, never a crash.
TEST(AssetFile, ForgedContentIsRefusedOrReadable) {
  const std::vector<std::byte> bytes = small_asset();
  const AssetPreamble preamble = read_preamble(bytes, "x.fan").value();
  const std::span<const std::byte> content = std::span(bytes).first(preamble.section_bytes()).subspan(kPreambleBytes);
  std::mt19937 random(7);
  std::size_t readable = 0;
  for (int round = 0; round < 2000; ++round) {
    SCOPED_TRACE(round);
    std::vector<std::byte> changed(content.begin(), content.end());
    for (int edit = 0; edit < 3; ++edit) changed[random() % changed.size()] = std::byte(random() % 256);
    const auto opened = AssetFile::from_memory(assemble_file(preamble, changed), "x.fan");
    if (!opened) {
      EXPECT_TRUE(opened.error().message.starts_with("x.fan: ")) << opened.error().message;
      EXPECT_EQ(opened.error().message.find("damaged in bytes"), std::string::npos) << "the checksums fit";
    } else {
      ++readable;
      (void)load_full(**opened);
    }
  }
  EXPECT_GT(readable, 100U);
}

}  // namespace
}  // namespace fanstream
