// Damaged assets: a clear error, or at worst a wrong mesh that is safe to draw, refine and coarsen.
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/support/asset_helpers.h"
#include "tests/support/exact_bytes.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

using testing::build_and_open;
using testing::ExactBytes;
using testing::is_manifold;
using testing::OpenAsset;
using testing::SeededRandom;
using testing::start;

const OpenAsset& asset() {
  static const OpenAsset built = build_and_open(testing::make_terrain(24, 22, 3));
  return built;
}

// Adds every segment, one of them with other bytes, and refines.
Result<std::uint64_t> refine_with(ProgressiveMesh& mesh, const OpenAsset& from, std::uint32_t bad_cell,
                                  std::uint32_t bad_segment, std::span<const std::byte> bad_bytes) {
  for (const auto& [cell, segment] : from.segments()) {
    const bool bad = cell == bad_cell && segment == bad_segment;
    const Result<void> added = mesh.add_segment(cell, segment, bad ? bad_bytes : from.segment(cell, segment));
    EXPECT_TRUE(added) << added.error().message;
  }
  return mesh.refine();
}

// A manifold without neighbours that are to be split in one generation.
void expect_sound(const ProgressiveMesh& mesh) {
  std::string why;
  ASSERT_TRUE(is_manifold(mesh, &why)) << why;
  ASSERT_LE(mesh.vertex_count(), mesh.head().vertex_count);
  const FanState& state = mesh.state();
  for (VertexId v = 0; v < state.fans.vertex_capacity(); ++v) {
    const std::uint8_t next = state.vertices[v].context.next;
    if (next == kNeverSplit) continue;
    state.fans.for_each_neighbour(
        v, [&](VertexId w) { ASSERT_NE(next, state.vertices[w].context.next) << "neighbours " << v << " and " << w; });
  }
}

TEST(Damage, AFlippedBitInASegmentIsAnErrorOrASafeMesh) {
  ASSERT_TRUE(asset().head);
  SeededRandom random(1);
  std::size_t tried = 0;
  std::size_t unnoticed = 0;
  for (const auto& [cell, segment] : asset().segments()) {
    ExactBytes bytes(asset().segment(cell, segment));
    for (int flip = 0; flip < 12; ++flip) {
      const std::uint32_t bit = random.below(bytes.view().size() * 8);
      SCOPED_TRACE("cell " + std::to_string(cell) + ", segment " + std::to_string(segment) + ", bit " +
                   std::to_string(bit));
      bytes.flip(bit);
      const auto mesh = start(asset());
      const auto refined = refine_with(*mesh, asset(), cell, segment, bytes.view());
      bytes.flip(bit);
      ++tried;
      if (refined) {
        ++unnoticed;
        EXPECT_TRUE(mesh->is_complete());
      } else {
        EXPECT_NE(refined.error().message.find("cell "), std::string::npos) << refined.error().message;
        EXPECT_FALSE(mesh->refine()) << "nothing is refined after an error";
        mesh->coarsen_to(0);
        EXPECT_TRUE(testing::image_of(*mesh) == testing::image_of(*start(asset())))
            << "coarsening all gives FM0, damaged or not";
      }
      expect_sound(*mesh);
      if (HasFatalFailure()) return;
    }
  }
  std::printf("[  figures ] %zu of %zu flipped bits in segments went unnoticed by the decoder\n", unnoticed, tried);
  EXPECT_LT(unnoticed * 4, tried);
}

TEST(Damage, SegmentsOfNoiseAreAnErrorOrASafeMesh) {
  ASSERT_TRUE(asset().head);
  const auto segments = asset().segments();
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const auto [cell, segment] = segments[random.below(segments.size())];
    std::vector<std::byte> noise(asset().segment(cell, segment).size());
    for (std::byte& b : noise) b = static_cast<std::byte>(random.below(256));
    const ExactBytes bytes(noise);
    const auto mesh = start(asset());
    (void)refine_with(*mesh, asset(), cell, segment, bytes.view());
    expect_sound(*mesh);
    if (HasFatalFailure()) return;
    mesh->coarsen_to(0);
    ASSERT_TRUE(testing::image_of(*mesh) == testing::image_of(*start(asset()))) << "next splits included";
  }
}

TEST(Damage, SegmentsThatDoNotExistAreRefusedByName) {
  ASSERT_TRUE(asset().head);
  const auto mesh = start(asset());
  const auto bytes = asset().segment(0, 0);
  for (const auto& [cell, segment] : {std::pair<std::uint32_t, std::uint32_t>{9999, 0}, {0, 99}}) {
    const auto added = mesh->add_segment(cell, segment, bytes);
    ASSERT_FALSE(added);
    EXPECT_NE(added.error().message.find("cell " + std::to_string(cell)), std::string::npos);
  }
  EXPECT_FALSE(mesh->add_segment(0, 0, bytes.first(bytes.size() - 1)));
  EXPECT_TRUE(mesh->add_segment(0, 0, bytes));
  EXPECT_TRUE(mesh->add_segment(0, 0, bytes)) << "a second copy is ignored";
  ProgressiveMesh without_index(asset().head);
  EXPECT_FALSE(without_index.add_segment(0, 0, bytes));
}

// Changes up to three bytes, or cuts the end off.
std::vector<std::byte> mutated(std::span<const std::byte> good, std::size_t from, SeededRandom& random) {
  std::vector<std::byte> bytes(good.begin(), good.end());
  if (random.one_in(8)) {
    bytes.resize(from + random.below(bytes.size() - from));
    return bytes;
  }
  for (std::uint32_t i = 0, n = 1 + random.below(3); i < n; ++i) {
    std::byte& byte = bytes[from + random.below(bytes.size() - from)];
    byte = random.one_in(2) ? byte ^ static_cast<std::byte>(1U << random.below(8))
                            : static_cast<std::byte>(random.below(256));
  }
  return bytes;
}

// Whatever was read is used as a client would use it.
void use(const AssetHead& head, AssetIndex index) {
  OpenAsset damaged = asset();
  damaged.head = std::make_shared<AssetHead>(head);
  for (std::uint32_t c = 0; c < index.cells.size(); ++c) {
    const std::uint32_t page = index.cells[c].segment_count;
    if (!index.has_page(c)) continue;
    ASSERT_LE(index.piece_offset(c, page) + index.piece_bytes(c, page), damaged.bytes.size());
    const auto bytes = std::span<const std::byte>(damaged.bytes).subspan(index.piece_offset(c, page));
    (void)read_page(bytes.first(index.piece_bytes(c, page)), c, head, index, "model.fan");
  }
  const bool whole = index.unknown_pages == 0;
  damaged.index = std::make_shared<AssetIndex>(std::move(index));
  const auto mesh = start(damaged);
  for (std::uint32_t c = 0; c < damaged.index->cells.size(); ++c) {
    if (!damaged.index->is_known(c) || (!whole && c >= damaged.index->first_paged)) continue;
    for (std::uint32_t s = 0; s < damaged.index->cells[c].segment_count; ++s) {
      ASSERT_LE(damaged.index->piece_offset(c, s) + damaged.index->piece_bytes(c, s), damaged.bytes.size());
      ASSERT_TRUE(mesh->add_segment(c, s, damaged.segment(c, s)));
    }
  }
  (void)mesh->refine();
  expect_sound(*mesh);
}

TEST(Damage, AMutatedIndexIsAClearErrorOrSafe) {
  ASSERT_TRUE(asset().head);
  std::size_t errors = 0;
  constexpr std::size_t kTries = 1500;
  for (std::uint64_t seed = 0; seed < kTries; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const ExactBytes bytes(mutated(asset().index_bytes(), 0, random));
    const auto index = read_index(bytes.view(), asset().preamble, *asset().head, "model.fan");
    if (index) {
      use(*asset().head, *index);
      if (HasFatalFailure()) return;
    } else {
      ++errors;
      EXPECT_EQ(index.error().message.rfind("model.fan: cell table", 0), 0U) << index.error().message;
    }
  }
  EXPECT_GT(errors * 10, kTries * 8);
}

TEST(Damage, AMutatedHeadIsAClearErrorOrSafe) {
  ASSERT_TRUE(asset().head);
  std::size_t errors = 0;
  for (std::uint64_t seed = 0; seed < 1000; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const ExactBytes bytes(mutated(asset().head_bytes(), kPreambleBytes, random));
    const auto head = read_head(bytes.view(), "model.fan");
    if (!head) {
      ++errors;
      EXPECT_EQ(head.error().message.rfind("model.fan", 0), 0U) << head.error().message;
      continue;
    }
    const auto index = read_index(asset().index_bytes(), asset().preamble, *head, "model.fan");
    if (!index) continue;
    use(*head, *index);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(errors, 300U);
}

TEST(Damage, EveryTruncationOfHeadAndIndexIsAClearError) {
  ASSERT_TRUE(asset().head);
  for (std::size_t size = 0; size < asset().head_bytes().size(); ++size) {
    const ExactBytes shorter{asset().head_bytes().first(size)};
    const auto head = read_head(shorter.view(), "model.fan");
    ASSERT_FALSE(head) << "cut to " << size;
    ASSERT_EQ(head.error().message.rfind("model.fan", 0), 0U) << head.error().message;
  }
  for (std::size_t size = 0; size < asset().index_bytes().size(); ++size) {
    const ExactBytes shorter{asset().index_bytes().first(size)};
    ASSERT_FALSE(read_index(shorter.view(), asset().preamble, *asset().head, "model.fan")) << "cut to " << size;
  }
}

TEST(Damage, AMutatedPreambleIsAClearErrorOrInRange) {
  ASSERT_TRUE(asset().head);
  const std::span<const std::byte> good = std::span(asset().bytes).first(kPreambleBytes);
  for (std::size_t size = 0; size < kPreambleBytes; ++size) {
    const auto preamble = read_preamble(ExactBytes(good.first(size)).view(), "model.fan");
    ASSERT_FALSE(preamble);
    ASSERT_NE(preamble.error().message.find("model.fan: cut short at byte " + std::to_string(size)), std::string::npos);
  }
  for (std::size_t bit = 0; bit < kPreambleBytes * 8; ++bit) {
    ExactBytes bytes(good);
    bytes.flip(bit);
    const auto preamble = read_preamble(bytes.view(), "model.fan");
    if (bit < 64) {
      ASSERT_FALSE(preamble) << "bit " << bit;
      EXPECT_EQ(preamble.error().kind, bit < 32 ? ErrorKind::bad_input : ErrorKind::unsupported);
    } else if (preamble) {
      EXPECT_LT(preamble->file_bytes(), 4ULL << 40U);
    }
  }
}

TEST(Damage, TheDigestTellsEveryFlippedBit) {
  ASSERT_TRUE(asset().head);
  ExactBytes content(std::span(asset().bytes).first(asset().preamble.section_bytes()).subspan(kPreambleBytes));
  EXPECT_EQ(content_digest(content.view()), asset().preamble.digest);
  SeededRandom random(4);
  for (int i = 0; i < 500; ++i) {
    const std::uint32_t bit = random.below(content.view().size() * 8);
    content.flip(bit);
    EXPECT_NE(content_digest(content.view()), asset().preamble.digest) << "bit " << bit;
    content.flip(bit);
  }
}

}  // namespace
}  // namespace fanstream
