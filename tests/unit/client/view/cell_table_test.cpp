#include "client/view/cell_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::SeededRandom;
using Cells = std::vector<std::uint32_t>;
// Slab 0: cells 0 and 1; slab 1: 2, 3, 4 of 0 and 5 of 1; slab 2: 6 and 7 of 2, 8 of 5.
CellTable three_slabs() {
  const SlabShape slabs[] = {{2, 2}, {4, 1}, {3, 3}};
  const std::uint32_t children[] = {3, 1, 2, 0, 0, 1};
  return *CellTable::create(slabs, children);
}

TEST(CellTable, NumbersCellsAndStepsBySlabAndLayer) {
  const CellTable table = three_slabs();
  EXPECT_EQ(table.cell_count(), 9U);
  EXPECT_EQ(table.step_count(), 2U * 2 + 4 * 1 + 3 * 3);
  EXPECT_EQ(table.parent(1), CellTable::kNoCell);
  EXPECT_EQ(table.parent(4), 0U);
  EXPECT_EQ(table.parent(5), 1U);
  EXPECT_EQ(table.parent(8), 5U);
  EXPECT_EQ(table.first_child(2), 6U);
  EXPECT_EQ(table.child_count(3), 0U);
  EXPECT_EQ(table.slab_of(5), 1U);
  EXPECT_EQ(table.step_index(0, 1), 0U);
  EXPECT_EQ(table.step_index(1, 2), 3U);
  EXPECT_EQ(table.step_index(2, 1), 4U);
  EXPECT_EQ(table.step_index(8, 3), 16U);
}

TEST(CellTable, GenerationsBelongToTheStepsThatJoinThem) {
  CellTable table = three_slabs();
  EXPECT_EQ(table.generations_of(2), 3U);
  table.set_layer_generations(2, 1, 3);
  EXPECT_EQ(table.generations_of(2), 5U);
  const std::uint32_t steps[] = {1, 2, 2, 2, 3};
  for (std::uint32_t g = 1; g <= 5; ++g) EXPECT_EQ(table.step_of(8, g), steps[g - 1]) << g;
  EXPECT_EQ(table.generations_of(0), 2U) << "other slabs have their own";
}

TEST(CellTable, DependenciesAreStepsOfEarlierLayers) {
  CellTable table = three_slabs();
  table.set_layer_generations(2, 1, 2);  // generations 2 and 3 are step 2
  table.add_needs(6, std::vector<Dependency>{{4, 7, 3}, {3, 8, 2}, {3, 7, 1}, {1, 5, 1}});
  using Steps = std::vector<std::pair<std::uint32_t, std::uint32_t>>;
  const auto needs = [&](std::uint32_t cell, std::uint32_t p) {
    Steps steps;
    table.for_each_dependency(cell, p, [&](std::uint32_t c, std::uint32_t q) { steps.emplace_back(c, q); });
    return steps;
  };
  EXPECT_EQ(needs(6, 1), (Steps{{2, 1}, {5, 1}})) << "the parent goes without saying";
  EXPECT_EQ(needs(6, 2), (Steps{{6, 1}, {7, 1}})) << "what 8 gives is of the same layer";
  EXPECT_EQ(needs(6, 3), (Steps{{6, 2}, {7, 2}}));
  EXPECT_EQ(needs(0, 1), Steps{});
  EXPECT_EQ(needs(2, 1), (Steps{{0, 2}}));
}

// Against a plain record of all that was told.
TEST(CellTable, NeedsAreNeverForgottenAndSayNothingTwice) {
  const SlabShape slabs[] = {{20, 9}};
  CellTable table = *CellTable::create(slabs, {});
  SeededRandom random(5);
  std::vector<std::vector<Dependency>> told(20);
  const auto needed = [](std::span<const Dependency> list, std::uint32_t generation, std::uint32_t cell) {
    std::uint32_t most = 0;
    for (const Dependency& d : list) {
      if (d.cell == cell && d.generation <= generation) most = std::max(most, d.on);
    }
    return most;
  };
  for (int i = 0; i < 2000; ++i) {
    const std::uint32_t cell = random.below(20);
    std::vector<Dependency> fresh;
    for (std::uint32_t left = random.below(4); left > 0; --left) {
      const std::uint32_t g = 2 + random.below(8);
      const Dependency d{g, random.below(20), 1 + random.below(g - 1)};
      if (d.cell != cell) fresh.push_back(d);
    }
    told[cell].insert(told[cell].end(), fresh.begin(), fresh.end());
    table.add_needs(cell, fresh);
    const auto known = table.needs(cell);
    for (std::uint32_t g = 1; g <= 9; ++g) {
      for (std::uint32_t n = 0; n < 20; ++n) ASSERT_EQ(needed(known, g, n), needed(told[cell], g, n)) << "change " << i;
    }
    for (std::size_t k = 0; k < known.size(); ++k) {
      if (k > 0) {
        ASSERT_GE(known[k - 1].generation, known[k].generation);
      }
      ASSERT_LT(needed(known, known[k].generation - 1, known[k].cell), known[k].on) << "said by a coarser generation";
    }
  }
}

TEST(CellTable, WhatIsKnownAlreadyIsNoChange) {
  CellTable table = three_slabs();
  const std::vector<Dependency> list{{3, 7, 2}, {2, 8, 1}};
  table.add_needs(6, list);
  table.set_supports(6, list);
  const std::uint64_t epoch = table.epoch();
  table.add_needs(6, std::vector<Dependency>{{3, 7, 1}});
  table.set_supports(6, list);
  EXPECT_EQ(table.epoch(), epoch);
  table.add_needs(6, std::vector<Dependency>{{2, 7, 1}});
  EXPECT_GT(table.epoch(), epoch);
  table.set_supports(6, {});
  EXPECT_TRUE(table.supports(6).empty());
}

TEST(CellTable, SumsFollowEveryChange) {
  CellTable table = three_slabs();
  SeededRandom random(9);
  for (int i = 0; i < 3000; ++i) {
    const std::uint32_t cell = random.below(9);
    const std::uint32_t segments = table.segment_count(cell);
    if (random.one_in(3)) table.set_segment(cell, random.below(segments), {0, random.below(99), random.below(50)});
    if (random.one_in(2)) {
      const std::uint32_t begun = random.below(segments + 1);
      table.set_applied(cell, begun > 0 && random.one_in(2) ? begun - 1 : begun, begun);
    }
    if (random.one_in(2)) table.set_held(cell, random.below(segments + 1));
    std::uint64_t triangles = 0, applied = 0;
    for (std::uint32_t c = 0; c < 9; ++c) {
      for (std::uint32_t p = 1; p <= table.begun(c); ++p) {
        triangles += table.triangles()[table.step_index(c, p)];
        applied += table.sizes_bytes()[table.step_index(c, p)];
      }
    }
    ASSERT_EQ(table.begun_triangles(), triangles);
    ASSERT_EQ(table.begun_bytes(), applied);
    std::uint64_t held = 0;
    for (std::uint32_t c = 0; c < 9; ++c) {
      for (std::uint32_t p = 1; p <= table.held(c); ++p) held += table.sizes_bytes()[table.step_index(c, p)];
    }
    ASSERT_EQ(table.held_bytes(), held);
  }
}

TEST(CellTable, EmptySegmentsCountAsHeldOnceTheirTurnComes) {
  CellTable table = three_slabs();
  for (std::uint32_t s = 0; s < 3; ++s) table.set_segment(6, s, {0, s == 1 ? 0U : 10U, 5});
  EXPECT_EQ(table.held(6), 0U);
  table.set_held(6, 1);
  EXPECT_EQ(table.held(6), 2U);
  EXPECT_EQ(table.held(7), 3U) << "all are empty";
}

TEST(CellTable, ErrorAfterTheLastSegmentIsThatOfTheChildren) {
  CellTable table = three_slabs();
  table.set_segment(0, 0, {8, 1, 1});
  table.set_segment(0, 1, {7, 1, 1});
  for (std::uint32_t c = 2; c < 5; ++c) table.set_segment(c, 0, {static_cast<float>(c), 1, 1});
  EXPECT_EQ(table.error_at(0, 0), 8.0F);
  EXPECT_EQ(table.error_at(0, 1), 7.0F);
  EXPECT_EQ(table.error_at(0, 2), 4.0F);
  EXPECT_EQ(table.error_at(3, 1), 0.0F) << "no children: the original";
}

TEST(CellTable, ExtentsAndTheirPartsAreKeptALittleWider) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const auto place = [&] { return glm::dvec3(1e5 + random.unit(), -3e4 - random.unit(), random.unit()); };
    const auto holds = [](const glm::dvec3& center, double radius, const glm::dvec3& other, double other_radius) {
      return glm::distance(center, other) + other_radius <= radius && radius < other_radius + 1e-6;
    };
    CellTable table = three_slabs();
    table.set_origin({1e5, -3e4, 0.5});
    std::vector<ExtentPart> kept;
    table.copy_parts(4, kept);
    EXPECT_TRUE(kept.empty());
    std::vector<std::vector<ExtentPart>> given(table.cell_count());
    std::vector<CellExtent> extents(table.cell_count());
    for (int round = 0; round < 2; ++round) {
      for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
        const std::size_t count = round == 0 ? random.below(5) : given[c].size();
        given[c].clear();
        while (given[c].size() < count) given[c].push_back({place(), random.unit()});
        extents[c] = {place(), random.unit()};
        const std::uint64_t epoch = table.epoch();
        table.set_extent(c, extents[c], given[c]);
        EXPECT_GT(table.extent_epoch(c), epoch);
      }
      for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
        EXPECT_TRUE(holds(table.extent(c).center, table.extent(c).radius, extents[c].center, extents[c].radius));
        table.copy_parts(c, kept);
        ASSERT_EQ(kept.size(), given[c].size());
        for (std::size_t i = 0; i < kept.size(); ++i) {
          EXPECT_TRUE(holds(kept[i].center, kept[i].radius, given[c][i].center, given[c][i].radius));
        }
      }
    }
  }
}

TEST(CellTable, InconsistentTablesAreRefused) {
  const auto refused = [](std::vector<SlabShape> slabs, Cells children) {
    const auto table = CellTable::create(slabs, children);
    return !table && table.error().kind == ErrorKind::bad_input && !table.error().message.empty();
  };
  EXPECT_TRUE(CellTable::create({}, {}));
  EXPECT_TRUE(refused({{2, 1}, {2, 1}}, {1}));
  EXPECT_TRUE(refused({{2, 1}, {2, 1}}, {1, 2}));
  EXPECT_TRUE(refused({{2, 1}, {2, 1}}, {1, 0}));
  EXPECT_TRUE(refused({{2, 1}, {2, 1}}, {0xFFFFFFFF, 3}));
  EXPECT_TRUE(refused({{2, 0}}, {}));
  EXPECT_TRUE(refused({{2, 251}}, {}));
  EXPECT_TRUE(refused({{1, 200}, {1, 51}}, {1}));
  EXPECT_TRUE(refused({{(1U << 22) + 1, 1}}, {}));
  EXPECT_TRUE(refused({{0xFFFFFFFF, 1}, {0xFFFFFFFF, 1}}, {}));

  const auto first_error = [](std::uint32_t cell, std::uint32_t segment, float error) {
    CellTable table = three_slabs();
    for (std::uint32_t c = 0; c < 9; ++c) {
      for (std::uint32_t s = 0; s < table.segment_count(c); ++s) table.set_segment(c, s, {1, 1, 1});
    }
    if (!table.check_errors()) return std::string("refused from the start");
    table.set_segment(cell, segment, {error, 1, 1});
    const auto checked = table.check_errors();
    return checked ? std::string() : checked.error().message;
  };
  EXPECT_EQ(first_error(0, 0, 5.0F), "");
  EXPECT_NE(first_error(0, 1, 1.5F).find("cell 0 segment 1"), std::string::npos) << "rises in the cell";
  EXPECT_NE(first_error(2, 0, 1.5F).find("cell 2 segment 0"), std::string::npos) << "rises to the child";
  EXPECT_NE(first_error(8, 2, -1.0F).find("cell 8 segment 2"), std::string::npos);
  EXPECT_NE(first_error(1, 0, NAN).find("cell 1 segment 0"), std::string::npos);
  EXPECT_NE(first_error(1, 0, INFINITY).find("cell 1 segment 0"), std::string::npos);
}

}  // namespace
}  // namespace fanstream
