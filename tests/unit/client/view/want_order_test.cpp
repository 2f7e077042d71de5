#include "client/view/want_order.h"

#include <gtest/gtest.h>

#include "tests/unit/client/view/cell_world.h"

namespace fanstream {
namespace {

// One slab of cells in a row, each beside the next; every step is missing up to the targets.
class Row {
 public:
  Row(std::uint32_t cells, std::uint32_t layers) {
    const SlabShape slab{cells, layers};
    table = *CellTable::create({&slab, 1}, {});
    for (std::uint32_t c = 0; c < cells; ++c) {
      std::vector<std::uint32_t> beside;
      if (c > 0) beside.push_back(c - 1);
      if (c + 1 < cells) beside.push_back(c + 1);
      table.add_needs(c, testing::needs_beside(table, c, beside));
    }
    judgements.resize(cells);
    for (CellJudgement& judgement : judgements) judgement = {{1.0, 1.0, 1.0, 1e-3}, 1.0, 1.0, 1.0};
    thresholds.assign(table.step_count(), 1.5F);
    held.assign(cells, 0);
    targets.assign(cells, 0);
    live.assign(cells, 1);
  }
  void set(std::uint32_t cell, std::uint32_t p, float error, std::uint32_t size_bytes) {
    table.set_segment(cell, p - 1, {error, size_bytes, 0});
  }
  std::vector<Want> order() const {
    std::vector<Want> wants;
    CellTable known = table;
    for (std::uint32_t c = 0; c < judgements.size(); ++c) known.set_extent(c, {});
    KeptJudgements kept(known);
    kept.begin({{1.0, 1.0, 1.0, 1e-3}, 1.0, 1.0, 1.0});
    for (std::uint32_t c = 0; c < judgements.size(); ++c) kept.set(c, judgements[c]);
    StepThresholds levels;
    levels.resize(table);
    EXPECT_EQ(levels.values.size(), thresholds.size());
    levels.values = thresholds;
    WantOrder().order({table, kept, levels, held, targets, live}, options, wants);
    return wants;
  }
  std::vector<std::uint32_t> cells() const {
    std::vector<std::uint32_t> cells;
    for (const Want& want : order()) cells.push_back(want.cell);
    return cells;
  }

  CellTable table;
  std::vector<CellJudgement> judgements;
  std::vector<float> thresholds;
  std::vector<std::uint8_t> held;
  std::vector<std::uint8_t> targets;
  std::vector<std::uint8_t> live;
  PlanOptions options;
};

using Cells = std::vector<std::uint32_t>;

TEST(WantOrder, MoreGainPerByteComesFirst) {
  Row row(4, 1);
  row.targets.assign(4, 1);
  row.set(0, 1, 0.01F, 100);
  row.set(1, 1, 0.02F, 400);
  row.set(2, 1, 0.03F, 100);
  row.set(3, 1, 0.02F, 100);
  EXPECT_EQ(row.cells(), (Cells{2, 3, 0, 1}));
  row.judgements[1].area_px = 10.0;
  EXPECT_EQ(row.cells().front(), 1U) << "a large one on the picture";
  row.judgements[0].weight = 100.0;
  EXPECT_EQ(row.cells().front(), 0U);
}

TEST(WantOrder, WhatAStepForcesIsPaidForByThoseThatNeedIt) {
  // Cells 0 and 8 want two steps; beside 0 the first step is missing and dear, beside 8 it is held.
  Row row(9, 2);
  for (std::uint32_t c = 0; c < 9; ++c) {
    row.set(c, 1, 0.0101F, 1000);
    row.set(c, 2, 0.01F, 100);
  }
  row.held = {1, 0, 0, 0, 0, 0, 0, 1, 1};
  row.targets = {2, 1, 0, 0, 0, 0, 0, 1, 2};
  const auto wants = row.order();
  ASSERT_EQ(wants.size(), 3U);
  EXPECT_EQ(wants[0].cell, 8U);
  EXPECT_EQ(wants[1].cell, 1U) << "0 needs it";
  EXPECT_EQ(wants[2].cell, 0U);
  const double gain = 0.01 / (1.0 - 0.01);
  EXPECT_NEAR(wants[0].utility, gain / 100, 1e-3 * gain / 100);
  EXPECT_NEAR(wants[2].utility, gain / 1100, 0.02 * gain / 1100) << "bytes of both";
  EXPECT_EQ(wants[1].utility, wants[2].utility);

  // If 2 needs it as well, both pay half.
  row.held[2] = row.held[3] = 1;
  row.targets[2] = 2;
  row.targets[3] = 1;
  const auto shared = row.order();
  ASSERT_EQ(shared.size(), 4U);
  EXPECT_NEAR(shared[2].utility, gain / 600, 0.02 * gain / 600);
}

TEST(WantOrder, AStepThatIsWorthMuchPullsWhatItNeedsToTheFront) {
  Row row(5, 2);
  for (std::uint32_t c = 0; c < 5; ++c) {
    row.set(c, 1, 0.01F, 100);
    row.set(c, 2, 0.01F, 100);
  }
  row.targets = {2, 1, 1, 1, 1};
  row.judgements[0].area_px = 1000.0;
  row.judgements[1].area_px = 1e-3;
  EXPECT_EQ(row.cells(), (Cells{0, 1, 0, 2, 3, 4})) << "the worthless neighbour 1 before 2, 3 and 4";
}

TEST(WantOrder, BandsComeBeforeUtility) {
  Row row(3, 1);
  row.targets.assign(3, 1);
  for (std::uint32_t c = 0; c < 3; ++c) row.set(c, 1, 0.01F, 100 * (3 - c));
  row.thresholds = {5.0F, 3.0F, 2.5F};
  EXPECT_EQ(row.cells(), (Cells{0, 2, 1})) << "4 to 8 px, then 2 to 4";
  row.options.band_octaves = 2.0;
  EXPECT_EQ(row.cells(), (Cells{0, 2, 1})) << "4 to 16 px, then 1 to 4";
  row.options.band_octaves = 3.0;
  EXPECT_EQ(row.cells(), (Cells{2, 1, 0})) << "one band";
  row.options.band_octaves = 1.0;
  row.options.tolerance_px = 2.4;
  EXPECT_EQ(row.cells(), (Cells{0, 2, 1}));
  row.options.band_octaves = 0.0;
  EXPECT_EQ(row.cells(), (Cells{2, 1, 0}));
}

TEST(WantOrder, CellsThatDoNotExistYetCountLess) {
  Row row(2, 1);
  row.targets.assign(2, 1);
  row.set(0, 1, 0.011F, 100);
  row.set(1, 1, 0.01F, 100);
  row.live[0] = 0;
  row.options.band_octaves = 0.0;
  const auto wants = row.order();
  ASSERT_EQ(wants.size(), 2U);
  EXPECT_EQ(wants[0].cell, 1U);
  EXPECT_FALSE(wants[0].speculative);
  EXPECT_TRUE(wants[1].speculative);
  row.options.speculation_weight = 1.0;
  EXPECT_EQ(row.cells(), (Cells{0, 1}));
  row.options.speculation_weight = 0.0;
  EXPECT_EQ(row.cells(), (Cells{1, 0}));
}

TEST(WantOrder, WhatDoesNotExistYetComesBeforeWhatNeedsIt) {
  Row row(3, 2);
  for (std::uint32_t c = 0; c < 3; ++c) {
    row.set(c, 1, 0.01F, 100);
    row.set(c, 2, 0.005F, 100);
  }
  row.held = {1, 0, 0};
  row.targets = {2, 1, 1};
  row.live[1] = 0;
  row.thresholds = {4.5F, 4.5F, 3.0F, 4.5F, 0.0F, 0.0F};  // by layer, then by cell
  row.judgements[2].area_px = 1000.0;
  EXPECT_EQ(row.cells(), (Cells{1, 0, 2})) << "1 is of a lower band by itself";
}

TEST(WantOrder, EmptySegmentsAreNotAskedForAndNumbersMayBeExtreme) {
  Row row(3, 2);
  row.targets.assign(3, 2);
  for (std::uint32_t c = 0; c < 3; ++c) {
    row.set(c, 1, 3e38F, c == 1 ? 0 : 0xFFFFFF);
    row.set(c, 2, 0.0F, 2);
  }
  row.thresholds.assign(6, 1e30F);
  row.judgements[2].area_px = 1e18;
  row.options.tolerance_px = 1e-300;
  EXPECT_EQ(row.cells().size(), 5U);
  row.options.tolerance_px = 0.0;
  EXPECT_EQ(row.cells().size(), 5U);
  row.options.max_wants = 0;
  EXPECT_TRUE(row.cells().empty());
}

}  // namespace
}  // namespace fanstream
