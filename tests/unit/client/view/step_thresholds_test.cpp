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
    CellWorld world(shape, random);
    if (random.one_in(2)) world.reveal_everything();
    const CellTable& table = world.table();
    const CellScales scales = random_scales(table, random);
    const float floor = random.one_in(3) ? 0.0F : static_cast<float>(5.0 * random.unit());

    // By repetition until nothing changes.
    std::vector<float> expected(table.step_count());
    for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
      for (std::uint32_t p = 1; p <= table.segment_count(c); ++p) {
        const float e = table.errors()[table.step_index(c, p)];
        const float distance = std::max({scales.near, scales.depth[c] - e, scales.slant[c] - 2 * e});
        const float px = scales.scale[c] * e / distance;
        expected[table.step_index(c, p)] = px > floor ? px : 0.0F;
      }
    }
    for (bool changed = true; changed;) {
      changed = false;
      for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
        for (std::uint32_t p = 1; p <= table.segment_count(c); ++p) {
          const float level = expected[table.step_index(c, p)];
          table.for_each_dependency(c, p, [&](std::uint32_t n, std::uint32_t q) {
            float& needed = expected[table.step_index(n, q)];
            if (needed < level) {
              needed = level;
              changed = true;
              ++raised;
            }
          });
        }
      }
    }
    std::vector<float> thresholds;
    compute_step_thresholds(table, scales, floor, thresholds);
    ASSERT_EQ(thresholds, expected);
  }
  EXPECT_GT(raised, 1000U);
}

TEST(StepThresholds, CountsAreTheStepsAboveALevel) {
  SeededRandom random(3);
  CellWorld world({}, random);
  world.reveal_everything();
  const CellTable& table = world.table();
  std::vector<float> thresholds;
  compute_step_thresholds(table, random_scales(table, random), 0.0F, thresholds);
  std::vector<std::uint8_t> counts;
  for (const float level : {0.0F, 0.5F, 5.0F, 50.0F}) {
    count_steps_above(table, thresholds, level, 1.25F, counts);
    for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
      for (std::uint32_t p = 1; p <= table.segment_count(c); ++p)
        ASSERT_EQ(thresholds[table.step_index(c, p)] * 1.25F > level, p <= counts[c]) << c << " " << p;
    }
  }
}

}  // namespace
}  // namespace fanstream
