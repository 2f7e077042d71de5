#include "client/collision/cell_hierarchy.h"

#include <gtest/gtest.h>

#include "tests/support/asset_helpers.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

constexpr std::uint32_t kNone = CellHierarchy::kNone;

TEST(CellHierarchy, HoldsEachCellOnceBelowTheCellThatItComesFrom) {
  for (const auto& [name, mesh] : testing::model_shapes()) {
    SCOPED_TRACE(name);
    const testing::OpenAsset asset = testing::build_and_open(mesh);
    ASSERT_TRUE(asset.head);
    const CellHierarchy cells(*asset.head, *asset.index);
    std::vector<int> seen(asset.index->cells.size(), 0);
    for (std::uint32_t n = 0; n < cells.node_count(); ++n) {
      const CellHierarchy::Node& node = cells.node(n);
      for (std::uint32_t k = 0; k < CellHierarchy::kWidth; ++k) {
        const std::uint32_t slot = CellHierarchy::kWidth * n + k;
        EXPECT_EQ(cells.below(slot), node.below[k]);
        if (node.below[k] != kNone) {
          EXPECT_GT(node.below[k], n);
          EXPECT_EQ(cells.node(node.below[k]).parent, slot);
        }
        if (node.cell[k] == kNone) continue;
        ++seen[node.cell[k]];
        EXPECT_EQ(cells.slot_of(node.cell[k]), slot);
        EXPECT_EQ(node.below[k] == kNone, asset.index->cells[node.cell[k]].child_count == 0);
        // The first cell above is the one that it comes from.
        std::uint32_t above = node.parent;
        while (above != kNone && cells.node(above / 4).cell[above % 4] == kNone) above = cells.node(above / 4).parent;
        const std::uint32_t parent = asset.index->cells[node.cell[k]].parent;
        EXPECT_EQ(above == kNone ? kNone : cells.node(above / 4).cell[above % 4], parent);
      }
    }
    for (const int times : seen) EXPECT_EQ(times, 1);
  }
}

TEST(CellHierarchy, OfAnAssetWithoutCellsIsAnEmptyRoot) {
  const CellHierarchy cells(AssetHead{}, AssetIndex{});
  ASSERT_EQ(cells.node_count(), 1U);
  for (std::uint32_t k = 0; k < CellHierarchy::kWidth; ++k) {
    EXPECT_EQ(cells.node(CellHierarchy::root()).cell[k], kNone);
    EXPECT_EQ(cells.below(k), kNone);
  }
}

}  // namespace
}  // namespace fanstream
