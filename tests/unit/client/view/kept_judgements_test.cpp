#include "client/view/kept_judgements.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::SeededRandom;

// By some orders of magnitude.
double any(SeededRandom& random, int largest_exponent) {
  return std::ldexp(0.5 + random.unit(), random.between(-largest_exponent, largest_exponent));
}

CellTable known_cells(std::uint32_t count) {
  const SlabShape slab{count, 1};
  CellTable table = *CellTable::create({&slab, 1}, {});
  for (std::uint32_t c = count; c-- > 0;) table.set_extent(c, {});
  return table;
}

TEST(KeptJudgements, ErrorsAreNeverBetterThanJudgedAndHardlyWorse) {
  SeededRandom random(1);
  const CellTable table = known_cells(7);
  KeptJudgements kept(table);
  for (int i = 0; i < 20000; ++i) {
    CellJudgement judgement;
    const double sign = random.one_in(4) ? -1.0 : 1.0;
    judgement.error = {any(random, 20), sign * any(random, 20), sign * any(random, 20), any(random, 10)};
    judgement.weight = 2.0 * random.unit();
    judgement.weight_within = random.unit();
    judgement.area_px = any(random, 30);
    judgement.in_frustum = random.one_in(2);
    judgement.facing = static_cast<Facing>(random.below(4));
    CellJudgement anywhere;
    anywhere.error.near = judgement.error.near;
    kept.begin(anywhere);
    const std::uint32_t cell = random.below(7);
    kept.set(cell, judgement);
    const CellJudgement found = kept[cell];
    ASSERT_EQ(found.error.near, judgement.error.near);
    ASSERT_GE(found.error.scale_px, judgement.error.scale_px);
    ASSERT_LE(found.error.depth, judgement.error.depth);
    ASSERT_LE(found.error.slant, judgement.error.slant);
    ASSERT_EQ(found.in_frustum, judgement.in_frustum);
    ASSERT_EQ(found.facing, judgement.facing);
    ASSERT_EQ(found.can_be_seen(), judgement.can_be_seen());
    ASSERT_FLOAT_EQ(static_cast<float>(found.weight), static_cast<float>(judgement.weight));
    ASSERT_FLOAT_EQ(static_cast<float>(found.weight_within), static_cast<float>(judgement.weight_within));
    ASSERT_FLOAT_EQ(static_cast<float>(found.area_px), static_cast<float>(judgement.area_px));
    const double error = any(random, 10);
    const double px = judgement.error.px(error);
    ASSERT_GE(found.error.px(error), px);
    const bool is_far = judgement.error.depth > 4.0 * error && judgement.error.slant > 4.0 * error;
    ASSERT_TRUE(!is_far || found.error.px(error) <= px * (1.0 + 1e-6)) << "judgement " << i;
  }
}

TEST(KeptJudgements, CellsWithoutExtentAreJudgedAsPartOfWhatTheyComeFrom) {
  const SlabShape slabs[] = {{2, 1}, {3, 1}, {2, 1}};
  const std::uint32_t children[] = {3, 0, 2, 0, 0};
  CellTable table = *CellTable::create(slabs, children);
  table.set_extent(0, {});
  KeptJudgements kept(table);
  CellJudgement anywhere;
  anywhere.area_px = 100.0;
  kept.begin(anywhere);
  kept.set(0, {{1.0, 2.0, 3.0, 1.0}, 2.0, 1.0, 60.0});
  EXPECT_EQ(kept[1].area_px, 100.0);
  EXPECT_EQ(kept[0].weight, 2.0);
  EXPECT_EQ(kept[3].weight, 1.0) << "as weight_within";
  EXPECT_EQ(kept[3].area_px, 20.0);
  EXPECT_EQ(kept[5].area_px, 10.0) << "a half of a third";
  EXPECT_EQ(kept[5].error.scale_px, kept[0].error.scale_px);
  table.set_extent(5, {});
  kept.begin(anywhere);
  kept.set(5, {{7.0, 2.0, 3.0, 1.0}, 0.5, 0.25, 5.0});
  EXPECT_EQ(kept[5].weight, 0.5);
  EXPECT_EQ(kept[6].weight, 1.0);
  EXPECT_EQ(kept[0].weight, 2.0) << "what was judged stays";
  JudgementWalk walk(kept);
  for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
    const CellJudgement walked = walk(c);
    EXPECT_EQ(walked.area_px, kept[c].area_px) << c;
    EXPECT_EQ(walked.weight, kept[c].weight) << c;
  }
}

TEST(KeptJudgements, NumbersBeyondSinglePrecisionStayFinite) {
  const CellTable table = known_cells(1);
  KeptJudgements kept(table);
  kept.begin({});
  kept.set(0, {{1e300, 1e300, -1e300, 1e-150}, 1e-300, 1.0, 1e300});
  const CellJudgement found = kept[0];
  EXPECT_TRUE(std::isfinite(found.error.scale_px) && std::isfinite(found.error.depth) &&
              std::isfinite(found.error.slant) && std::isfinite(found.area_px));
  EXPECT_LE(found.error.depth, 1e300);
}

}  // namespace
}  // namespace fanstream
