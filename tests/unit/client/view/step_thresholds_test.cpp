#include "client/view/step_thresholds.h"

#include <gtest/gtest.h>

#include "tests/unit/client/view/cell_world.h"

namespace fanstream {
namespace {

using testing::CellWorld;
using testing::CellWorldShape;
using testing::SeededRandom;

CellScales random_scales(const CellTable& table, SeededRandom& random) {
  CellScales scales;
  scales.resize(table.cell_count());
  for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
    const double near = 0.01;
    scales.set(c, {100.0 * random.unit(), 4.0 * random.unit() - 1.0, 4.0 * random.unit() - 1.0, near},
               random.one_in(3) ? 0.0 : random.unit());
  }
  return scales;
}

TEST(StepThresholds, AreTheLargestOfAllThatDependsOnAStep) {
  std::uint64_t raised = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    CellWorldShape shape;
    shape.slabs = 1 + random.below(4);
    shape.most_generations = random.one_in(2) ? 1 : 3;
    CellWorld world(shape, random);
    if (random.one_in(2)) world.reveal_everything();
    const CellTable& table = world.table();
    const CellScales scales = random_scales(table, random);
    const float floor = random.one_in(3) ? 0.0F : static_cast<float>(5.0 * random.unit());

    // By repetition until nothing changes, generation by generation of each step.
    std::vector<std::vector<float>> expected(table.step_count());
    const auto generations = [&](std::uint32_t c, std::uint32_t p) -> std::vector<float>& {
      return expected[table.step_index(c, p)];
    };
    for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
      for (std::uint32_t p = 1; p <= table.segment_count(c); ++p) {
        const float e = table.errors()[table.step_index(c, p)];
        const float distance = std::max({scales.near, scales.depth[c] - e, scales.slant[c] - 2 * e});
        const float px = scales.scale[c] * e / distance;
        generations(c, p).assign(table.layer_generations(table.slab_of(c), p - 1), px > floor ? px : 0.0F);
      }
    }
    for (bool changed = true; changed;) {
      changed = false;
      const auto need = [&](float& needed, float level) {
        if (needed >= level) return;
        needed = level;
        changed = true;
        ++raised;
      };
      for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
        for (std::uint32_t p = 1; p <= table.segment_count(c); ++p) {
          const std::vector<float>& own = generations(c, p);
          for (std::size_t g = own.size() - 1; g > 0; --g) {
            need(generations(c, p)[g - 1], own[g]);
            for (const std::uint32_t n : table.peers(c)) need(generations(n, p)[g - 1], own[g]);
          }
          table.for_each_dependency(c, p,
                                    [&](std::uint32_t n, std::uint32_t q) { need(generations(n, q).back(), own[0]); });
        }
      }
    }
    StepThresholds thresholds;
    ThresholdPass().run(table, scales, floor, thresholds);
    for (std::uint32_t step = 0; step < table.step_count(); ++step) {
      ASSERT_EQ(thresholds.begun[step], expected[step].front());
      const float whole = table.joins_generations() ? thresholds.whole[step] : thresholds.begun[step];
      ASSERT_EQ(whole, expected[step].back());
    }
    ASSERT_EQ(thresholds.whole.empty(), !table.joins_generations());
  }
  EXPECT_GT(raised, 1000U);
}

TEST(StepThresholds, CountsAreTheStepsAboveALevel) {
  SeededRandom random(3);
  CellWorld world({}, random);
  world.reveal_everything();
  const CellTable& table = world.table();
  StepThresholds thresholds;
  ThresholdPass().run(table, random_scales(table, random), 0.0F, thresholds);
  std::vector<std::uint8_t> counts;
  for (const float level : {0.0F, 0.5F, 5.0F, 50.0F}) {
    count_steps_above(table, thresholds.begun, level, 1.25F, counts);
    for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
      for (std::uint32_t p = 1; p <= table.segment_count(c); ++p)
        ASSERT_EQ(thresholds.begun[table.step_index(c, p)] * 1.25F > level, p <= counts[c]) << c << " " << p;
    }
  }
}

// Two cells that know nothing of each other but that one has been applied on top of the other.
TEST(StepThresholds, WhatHasBeenAppliedKeepsWhatItLiesOn) {
  const std::vector<SlabShape> slabs{{2, 3}};
  CellTable table = CellTable::create(slabs, {}).value();
  for (std::uint32_t c = 0; c < 2; ++c) {
    for (std::uint32_t s = 0; s < 3; ++s) table.set_segment(c, s, {static_cast<float>(3 - s), 10, 2});
  }
  CellScales scales;
  scales.resize(2);
  const ProjectedError plain{1.0, 1.0, 1.0, 1.0};
  scales.set(0, plain, 1.0);
  scales.set(1, plain, 0.0);
  StepThresholds thresholds;
  ThresholdPass pass;
  pass.run(table, scales, 0.0F, thresholds);
  for (std::uint32_t p = 1; p <= 3; ++p) EXPECT_EQ(thresholds.begun[table.step_index(1, p)], 0.0F);
  const std::vector<Support> supports{{3, 1, 2}};
  table.set_supports(0, supports);
  pass.run(table, scales, 0.0F, thresholds);
  EXPECT_EQ(thresholds.begun[table.step_index(1, 2)], thresholds.begun[table.step_index(0, 3)]);
  EXPECT_EQ(thresholds.begun[table.step_index(1, 1)], thresholds.begun[table.step_index(0, 3)]);
  EXPECT_EQ(thresholds.begun[table.step_index(1, 3)], 0.0F);
  table.set_supports(0, {});
  pass.run(table, scales, 0.0F, thresholds);
  for (std::uint32_t p = 1; p <= 3; ++p) EXPECT_EQ(thresholds.begun[table.step_index(1, p)], 0.0F);
}

}  // namespace
}  // namespace fanstream
