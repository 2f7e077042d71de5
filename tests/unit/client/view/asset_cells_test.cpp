#include "client/view/asset_cells.h"

#include <gtest/gtest.h>

#include "client/view/planner.h"
#include "common/mesh/triangle_mesh.h"
#include "tests/support/asset_helpers.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

using testing::build_and_open;

TEST(AssetCells, TableIsWhatHeadAndIndexSay) {
  const auto asset = build_and_open(testing::make_sphere(60, 80));
  ASSERT_TRUE(asset.head);
  const AssetHead& head = *asset.head;
  const AssetIndex& index = *asset.index;
  const auto table = cell_table_of(head, index, "sphere");
  ASSERT_TRUE(table) << table.error().message;
  ASSERT_EQ(table->cell_count(), index.cells.size());
  ASSERT_EQ(table->slab_count(), head.slab_ends.size());
  ASSERT_GT(table->slab_count(), 1U);
  std::uint64_t triangles = table->base_triangles();
  std::uint64_t bytes = 0, pages = 0;
  for (std::uint32_t c = 0; c < table->cell_count(); ++c) {
    const CellEntry& entry = index.cells[c];
    ASSERT_EQ(table->slab_of(c), entry.slab);
    ASSERT_EQ(table->parent(c), entry.parent);
    ASSERT_EQ(table->child_count(c), entry.child_count);
    if (entry.child_count > 0) {
      ASSERT_EQ(table->first_child(c), entry.first_child);
    }
    ASSERT_EQ(table->segment_count(c), index.piece_count(c));
    if (index.has_page(c)) {
      const std::uint32_t page = table->step_index(c, entry.segment_count + 1);
      ASSERT_EQ(table->sizes_bytes()[page], 0U) << "it is known";
      ASSERT_EQ(table->triangles()[page], 0U);
      ASSERT_GE(table->errors()[page], error_from_code(entry.rest_code, head.grid.step()));
      pages += entry.page_bytes;
    }
    for (std::uint32_t p = 1; p <= entry.segment_count; ++p) {
      const SegmentEntry& segment = index.segments[entry.first_segment + p - 1];
      const std::uint32_t step = table->step_index(c, p);
      ASSERT_EQ(table->sizes_bytes()[step], segment.size_bytes);
      ASSERT_GE(table->errors()[step], error_from_code(segment.error_code, head.grid.step()));
      ASSERT_LE(table->errors()[step], error_from_code(segment.error_code, head.grid.step()) * (1 + 1e-6));
      triangles += table->triangles()[step];
      bytes += segment.size_bytes;
    }
  }
  EXPECT_EQ(triangles, head.triangle_count) << "a closed surface: two a split";
  EXPECT_GT(pages, 0U);
  EXPECT_EQ(bytes + pages + range_table_bytes(head, index), asset.preamble.segment_bytes);
  std::uint32_t generations = 0;
  for (std::uint32_t s = 0; s < table->slab_count(); ++s) {
    for (std::uint32_t l = 0; l < table->layers_of(s); ++l) generations += table->layer_generations(s, l);
  }
  EXPECT_EQ(generations, head.generation_count() + 1) << "and the pages";
}

TEST(AssetCells, BoundsThatRiseAreRefused) {
  const auto asset = build_and_open(testing::make_sphere(20, 30));
  ASSERT_TRUE(asset.head);
  AssetIndex index = *asset.index;
  index.segments.front().error_code = 3;
  index.segments.back().error_code = 200;
  const auto table = cell_table_of(*asset.head, index, "spoilt.fan");
  ASSERT_FALSE(table);
  EXPECT_EQ(table.error().kind, ErrorKind::bad_input);
  EXPECT_EQ(table.error().message.find("spoilt.fan: cell "), 0U) << table.error().message;
}

TEST(AssetCells, AModelWithoutCellsHasAnEmptyTable) {
  AssetHead head;
  head.base.triangles.resize(4);
  const auto table = cell_table_of(head, {}, "tetrahedron");
  ASSERT_TRUE(table);
  EXPECT_EQ(table->cell_count(), 0U);
  Planner planner(*table);
  EXPECT_EQ(planner.plan({}, {}).planned_triangles, 4U);
}

}  // namespace
}  // namespace fanstream
