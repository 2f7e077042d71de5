#include "client/model/segment_order.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/built_model.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

const AssetFile& asset() {
  static const auto built = testing::build_model(testing::make_terrain(60, 60, 4));
  return *built;
}

TEST(SegmentOrder, IsTheFilesOrderAndCoversItAll) {
  const auto order = order_segments(*asset().asset_head(), *asset().asset_index());
  ASSERT_EQ(order.size(), asset().asset_index()->segments.size());
  const std::byte* next = asset().head().data() + asset().head().size() + asset().index().size();
  for (const OrderedSegment& segment : order) {
    const auto bytes = asset().segment(segment.cell, segment.segment);
    if (bytes.empty()) continue;
    ASSERT_EQ(bytes.data(), next);
    next += bytes.size();
  }
  EXPECT_EQ(next, asset().bytes().data() + asset().preamble().section_bytes());
}

TEST(SegmentOrder, LayersFollowOneAnotherFromTheFirstToTheLast) {
  const auto order = order_segments(*asset().asset_head(), *asset().asset_index());
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.layer < b.layer; }));
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
