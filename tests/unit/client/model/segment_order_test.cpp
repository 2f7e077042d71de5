#include "client/model/segment_order.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/asset_helpers.h"
#include "tests/support/built_model.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

// With pages.
const AssetFile& asset() {
  static const auto built = testing::build_model(testing::make_terrain(60, 60, 4), testing::small_cells());
  return *built;
}

TEST(SegmentOrder, IsTheFilesOrderAndCoversItAll) {
  const AssetIndex& index = *asset().asset_index();
  const auto order = order_segments(*asset().asset_head(), index);
  ASSERT_EQ(order.size(), index.segments.size() + index.first_paged - index.first_page_owner);
  const std::byte* next = asset().head().data() + asset().head().size() + asset().index().size();
  for (const OrderedSegment& segment : order) {
    const auto bytes = asset().segment(segment.cell, segment.segment);
    ASSERT_EQ(bytes.size(), segment.size_bytes);
    if (bytes.empty()) continue;
    ASSERT_EQ(bytes.data(), next);
    next += bytes.size();
  }
  EXPECT_EQ(next + range_table_bytes(*asset().asset_head(), index),
            asset().bytes().data() + asset().preamble().section_bytes());
}

TEST(SegmentOrder, EndsWithThePagesWhileTheyAreMissing) {
  auto index = read_index(asset().index(), asset().preamble(), *asset().asset_head(), "x");
  ASSERT_TRUE(index);
  const auto first = order_segments(*asset().asset_head(), *index);
  const auto whole = order_segments(*asset().asset_head(), *asset().asset_index());
  ASSERT_LT(first.size(), whole.size());
  EXPECT_EQ(first.back().layer, kPageLayer);
  EXPECT_NE(whole[first.size()].layer, kPageLayer);
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].cell, whole[i].cell);
    EXPECT_EQ(first[i].segment, whole[i].segment);
  }
}

TEST(SegmentOrder, LayersFollowOneAnotherFromTheFirstToTheLast) {
  auto order = order_segments(*asset().asset_head(), *asset().asset_index());
  std::erase_if(order, [](const OrderedSegment& s) { return s.layer == kPageLayer; });
  EXPECT_TRUE(
      std::is_sorted(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.layer < b.layer; }));
  EXPECT_EQ(order.front().layer, 0U);
  EXPECT_EQ(order.back().layer + 1, asset().asset_head()->layer_ends.size());
}

TEST(SegmentOrder, WantsNameEverySegmentOnceInOrder) {
  const auto order = order_segments(*asset().asset_head(), *asset().asset_index());
  for (const std::size_t end : {std::size_t{0}, std::size_t{1}, order.size() / 2, order.size(), order.size() + 7}) {
    SCOPED_TRACE(end);
    std::vector<std::uint32_t> sent(asset().cell_count(), 0);
    std::size_t position = 0;
    for (const CellRun& run : wants_for(order, end)) {
      for (std::uint32_t cell = run.first_cell; cell < run.first_cell + run.cell_count; ++cell) {
        for (; sent[cell] < run.prefix; ++sent[cell], ++position) {
          ASSERT_EQ(order[position].cell, cell);
          ASSERT_EQ(order[position].segment, sent[cell]);
        }
      }
    }
    EXPECT_EQ(position, std::min(end, order.size()));
  }
}

}  // namespace
}  // namespace fanstream
