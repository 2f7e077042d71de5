#include "server/verify/asset_checks.h"

#include <gtest/gtest.h>

#include "common/refine/full_mesh.h"
#include "server/verify/source_comparison.h"
#include "tests/support/small_assets.h"

namespace fanstream {
namespace {

// A whole asset of changed parts, with digest and sizes that fit.
std::shared_ptr<const AssetFile> forged(const AssetFile& asset, const AssetHead& head, AssetIndex index,
                                        const std::vector<std::byte>& segments) {
  ByteWriter head_bytes;
  write_head(head, asset.head().last(head.base_bytes), head_bytes);
  ByteWriter index_bytes;
  write_index(index, head, index_bytes);
  AssetPreamble preamble;
  preamble.head_bytes = kPreambleBytes + head_bytes.size();
  preamble.index_bytes = index_bytes.size();
  preamble.segment_bytes = segments.size();
  ByteWriter body;
  body.bytes(head_bytes.view());
  body.bytes(index_bytes.view());
  body.bytes(segments);
  auto opened = AssetFile::from_memory(assemble_file(preamble, body.view()), "forged");
  EXPECT_TRUE(opened.has_value()) << opened.error().message;
  return opened ? *opened : nullptr;
}

std::vector<std::byte> segments_of(const AssetFile& asset) {
  const auto view = asset.bytes().first(asset.preamble().section_bytes()).last(asset.preamble().segment_bytes);
  return {view.begin(), view.end()};
}

std::string first_failure(const AssetFile& asset) {
  for (const AssetCheck& check : asset_checks(asset)) {
    if (const Result<std::string> found = check.run(); !found) return check.name + ": " + found.error().message;
  }
  return {};
}

class AssetChecksTest : public ::testing::Test {
 protected:
  // Without pages, whose contents would have to be forged with the index.
  static std::vector<std::byte> built() {
    BuildOptions options = testing::small_build_options();
    options.paged_cells = 1U << 30U;
    return build_asset(testing::make_torus(20, 12), options).value().bytes;
  }
  std::shared_ptr<const AssetFile> asset = AssetFile::from_memory(built(), "torus").value();
};

TEST_F(AssetChecksTest, BuiltAssetPassesAll) {
  EXPECT_EQ(first_failure(*asset), "");
  EXPECT_EQ(first_failure(**AssetFile::from_memory(testing::small_asset(), "torus with pages")), "");
  TriangleMesh two = testing::make_terrain(18, 16, 1);
  testing::append(two, testing::make_open_cylinder(9, 6), {30.0, 0.0, 0.0});
  EXPECT_EQ(first_failure(**AssetFile::from_memory(testing::small_asset(two), "two")), "");
  EXPECT_EQ(first_failure(**AssetFile::from_memory(testing::small_asset(testing::make_grid(1, 1)), "quad")), "");
}

TEST_F(AssetChecksTest, ForgingWithoutChangesChangesNothing) {
  EXPECT_EQ(forged(*asset, *asset->asset_head(), *asset->asset_index(), segments_of(*asset))->digest(),
            asset->digest());
}

TEST_F(AssetChecksTest, DamagedSegmentBehindFittingChecksumsIsFoundByRefining) {
  std::vector<std::byte> segments = segments_of(*asset);
  // Several bytes: a bit alone may make another mesh that is as good.
  for (std::size_t i = 0; i < 8; ++i) segments[segments.size() / 2 + i] ^= std::byte{0x55};
  const auto damaged = forged(*asset, *asset->asset_head(), *asset->asset_index(), segments);
  const std::string failure = first_failure(*damaged);
  EXPECT_TRUE(failure.starts_with("refinement: forged: cell ")) << failure;
}

TEST_F(AssetChecksTest, WrongCountsAreFoundByRefining) {
  AssetHead head = *asset->asset_head();
  ++head.triangle_count;
  std::string failure = first_failure(*forged(*asset, head, *asset->asset_index(), segments_of(*asset)));
  EXPECT_NE(failure.find("refines to 480 triangles, its head says 481"), std::string::npos) << failure;
  head = *asset->asset_head();
  ++head.component_count;
  failure = first_failure(*forged(*asset, head, *asset->asset_index(), segments_of(*asset)));
  EXPECT_NE(failure.find("refines to 1 components, its head says 2"), std::string::npos) << failure;
}

TEST_F(AssetChecksTest, BoundThatGrowsTowardsTheFineIsFound) {
  AssetIndex index = *asset->asset_index();
  std::uint8_t code = 1;
  std::size_t segments = 0;
  for (SegmentEntry& segment : index.segments) {
    if (segment.size_bytes == 0) continue;
    segment.error_code = code++;  // by cell, so that a later one is larger
    ++segments;
  }
  ASSERT_GT(segments, 4U);
  const std::string failure = first_failure(*forged(*asset, *asset->asset_head(), index, segments_of(*asset)));
  EXPECT_TRUE(failure.starts_with("bounds: ")) << failure;
}

TEST_F(AssetChecksTest, BoundThatIsTooSmallIsFound) {
  AssetIndex index = *asset->asset_index();
  for (SegmentEntry& segment : index.segments) segment.error_code = 1;  // a sixteenth of a grid step
  const std::string failure = first_failure(*forged(*asset, *asset->asset_head(), index, segments_of(*asset)));
  EXPECT_TRUE(failure.starts_with("bounds: ") && failure.find("the model is off by") != std::string::npos) << failure;
}

class SourceComparisonTest : public AssetChecksTest {
 protected:
  Result<std::string> compare(const TriangleMesh& source) const {
    return compare_with_source(load_full(*asset).value()->triangle_mesh(), asset->asset_head()->grid, source, "asset",
                               "input");
  }
  TriangleMesh input = testing::make_torus(20, 12);
};

TEST_F(SourceComparisonTest, OrderAndRotationDoNotMatter) {
  EXPECT_TRUE(compare(input).has_value());
  const Result<std::string> shuffled = compare(testing::shuffled(input, 5));
  EXPECT_TRUE(shuffled.has_value()) << shuffled.error().message;
}

TEST_F(SourceComparisonTest, EveryKindOfDifferenceIsNamed) {
  TriangleMesh flipped = input;
  std::swap(flipped.triangles[7][0], flipped.triangles[7][1]);
  const auto wrong_winding = compare(flipped);
  ASSERT_FALSE(wrong_winding.has_value());
  EXPECT_NE(wrong_winding.error().message.find("1 only in the asset: ("), std::string::npos)
      << wrong_winding.error().message;
  EXPECT_NE(wrong_winding.error().message.find("1 only in the input: ("), std::string::npos);

  TriangleMesh fewer = input;
  fewer.triangles.pop_back();
  EXPECT_FALSE(compare(fewer).has_value());

  TriangleMesh moved = input;
  moved.positions[3].x += 2.0 * asset->asset_head()->grid.step();
  EXPECT_FALSE(compare(moved).has_value());

  TriangleMesh within_rounding = input;
  within_rounding.positions[3] = asset->asset_head()->grid.decode(asset->asset_head()->grid.encode(input.positions[3]));
  EXPECT_TRUE(compare(within_rounding).has_value());

  TriangleMesh outside = input;
  outside.positions[3].z += 100.0;
  const auto off_grid = compare(outside);
  ASSERT_FALSE(off_grid.has_value());
  EXPECT_NE(off_grid.error().message.find("vertex 3 "), std::string::npos) << off_grid.error().message;

  TriangleMesh unused = input;
  unused.positions.push_back(unused.positions[0]);
  EXPECT_FALSE(compare(unused).has_value());
}

}  // namespace
}  // namespace fanstream
