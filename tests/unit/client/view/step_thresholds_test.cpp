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

// A part of what is given for all cells.
ScalesOf parts_of(const CellScales& all) {
  return [all](std::uint32_t first, std::uint32_t count, CellScales& scales) {
    const auto part = [&](const std::vector<float>& values) {
      return std::vector<float>(values.begin() + first, values.begin() + first + count);
    };
    scales = {part(all.scale), part(all.depth), part(all.slant), all.near};
  };
}

// Of some cells' single generations, on any earlier one.
void add_random_dependencies(CellTable& table, SeededRandom& random) {
  const std::uint32_t one_in = 1 + random.below(30);
  for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
    if (!random.one_in(one_in)) continue;
    std::vector<Dependency> list;
    const std::uint32_t slab = table.slab_of(c);
    for (std::uint32_t left = random.below(4); left > 0; --left) {
      const std::uint32_t other = random.below(table.first_cell(slab) + table.cells_of(slab));
      const std::uint32_t g = 1 + random.below(table.generations_of(slab));
      const bool same = table.slab_of(other) == slab;
      if (other == c || (same && g == 1)) continue;
      list.push_back({g, other, 1 + random.below(same ? g - 1 : table.generations_of(table.slab_of(other)))});
    }
    if (random.one_in(2)) {
      table.add_needs(c, list);
    } else {
      table.set_supports(c, list);
    }
  }
}

// By cell and generation, by repetition until nothing changes. Counts in `raised` what others have asked for.
std::vector<std::vector<float>> thresholds_by_repetition(const CellTable& table, const CellScales& scales, float floor,
                                                         std::uint64_t& raised) {
  std::vector<std::vector<float>> levels(table.cell_count());
  for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
    levels[c].assign(table.generations_of(table.slab_of(c)), 0.0F);
    for (std::uint32_t g = 1; g <= levels[c].size(); ++g) {
      const std::uint32_t p = table.step_of(c, g);
      if (g < levels[c].size() && table.step_of(c, g + 1) == p) continue;
      const float e = table.errors()[table.step_index(c, p)];
      const float distance = std::max({scales.near, scales.depth[c] - e, scales.slant[c] - 2 * e});
      const float px = scales.scale[c] * e / distance;
      levels[c][g - 1] = px > floor ? px : 0.0F;
    }
  }
  for (bool changed = true; changed;) {
    changed = false;
    const auto need = [&](std::uint32_t cell, std::uint32_t generation, float level) {
      if (levels[cell][generation - 1] >= level) return;
      levels[cell][generation - 1] = level;
      changed = true;
      ++raised;
    };
    for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
      for (std::uint32_t g = 2; g <= levels[c].size(); ++g) need(c, g - 1, levels[c][g - 1]);
      const std::uint32_t parent = table.parent(c);
      if (parent != CellTable::kNoCell) need(parent, static_cast<std::uint32_t>(levels[parent].size()), levels[c][0]);
      for (const auto& list : {table.needs(c), table.supports(c)}) {
        for (const Dependency& d : list) need(d.cell, d.on, levels[c][d.generation - 1]);
      }
    }
  }
  return levels;
}

void expect_thresholds(const CellTable& table, const StepThresholds& thresholds,
                       const std::vector<std::vector<float>>& expected) {
  for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
    for (std::uint32_t g = 1; g <= expected[c].size(); ++g) {
      const std::uint32_t p = table.step_of(c, g);
      if (g == 1 || table.step_of(c, g - 1) != p) {
        ASSERT_EQ(thresholds.begun(table, c, p), expected[c][g - 1]);
      }
      if (g < expected[c].size() && table.step_of(c, g + 1) == p) continue;
      ASSERT_EQ(thresholds.whole(table, c, p), expected[c][g - 1]);
    }
  }
}

// Also where the table changes between runs of one pass.
TEST(StepThresholds, AreTheLargestOfAllThatDependsOnAStep) {
  std::uint64_t raised = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    CellWorldShape shape;
    shape.slabs = 1 + random.below(4);
    if (shape.slabs < 3) shape.roots = 1 + random.below(150);
    shape.most_generations = random.one_in(2) ? 1 : 3;
    CellWorld world(shape, random);
    CellTable& table = world.table();
    if (random.one_in(2)) world.reveal_everything();
    ThresholdPass pass(table);
    StepThresholds thresholds;
    for (int run = 0; run < 4; ++run) {
      SCOPED_TRACE("run " + std::to_string(run));
      if (run != 1) add_random_dependencies(table, random);
      if (run == 3) table.set_layer_generations(0, 0, table.layer_generations(0, 0) + 1);
      const CellScales scales = random_scales(table, random);
      const float floor = random.one_in(3) ? 0.0F : static_cast<float>(5.0 * random.unit());
      pass.run(parts_of(scales), floor, thresholds);
      expect_thresholds(table, thresholds, thresholds_by_repetition(table, scales, floor, raised));
      if (HasFatalFailure()) return;
    }
  }
  EXPECT_GT(raised, 1000U);
}

TEST(StepThresholds, CountsAreTheStepsAboveALevel) {
  SeededRandom random(3);
  CellWorld world({}, random);
  world.reveal_everything();
  const CellTable& table = world.table();
  StepThresholds thresholds;
  ThresholdPass(table).run(parts_of(random_scales(table, random)), 0.0F, thresholds);
  std::vector<std::uint8_t> counts;
  for (const float level : {0.0F, 0.5F, 5.0F, 50.0F}) {
    count_steps_above(table, thresholds, thresholds.begun_rows, level, 1.25F, counts);
    for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
      for (std::uint32_t p = 1; p <= table.segment_count(c); ++p)
        ASSERT_EQ(thresholds.begun(table, c, p) * 1.25F > level, p <= counts[c]) << c << " " << p;
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
  ThresholdPass pass(table);
  pass.run(parts_of(scales), 0.0F, thresholds);
  for (std::uint32_t p = 1; p <= 3; ++p) EXPECT_EQ(thresholds.begun(table, 1, p), 0.0F);
  const std::vector<Dependency> supports{{3, 1, 2}};
  table.set_supports(0, supports);
  pass.run(parts_of(scales), 0.0F, thresholds);
  EXPECT_EQ(thresholds.begun(table, 1, 2), thresholds.begun(table, 0, 3));
  EXPECT_EQ(thresholds.begun(table, 1, 1), thresholds.begun(table, 0, 3));
  EXPECT_EQ(thresholds.begun(table, 1, 3), 0.0F);
  table.set_supports(0, {});
  pass.run(parts_of(scales), 0.0F, thresholds);
  for (std::uint32_t p = 1; p <= 3; ++p) EXPECT_EQ(thresholds.begun(table, 1, p), 0.0F);
}

}  // namespace
}  // namespace fanstream
