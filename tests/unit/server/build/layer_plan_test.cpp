#include "server/build/layer_plan.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

std::vector<std::uint32_t> growing(std::uint32_t base, double growth, std::uint32_t generations) {
  std::vector<std::uint32_t> vertices{base};
  for (std::uint32_t g = 0; g < generations; ++g) {
    vertices.push_back(static_cast<std::uint32_t>(vertices.back() * growth) + 1);
  }
  return vertices;
}

void expect_rising_to(const std::vector<std::uint8_t>& ends, std::size_t most) {
  for (std::size_t i = 0; i < ends.size(); ++i) ASSERT_GT(ends[i], i == 0 ? 0 : ends[i - 1]);
  ASSERT_EQ(ends.empty() ? 0 : ends.back(), most);
}

TEST(LayerPlan, LayersAndSlabsCoverAllGenerations) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    testing::SeededRandom random(seed);
    const auto vertices = growing(10 + random.below(300), 1.05 + random.unit(), random.below(30));
    LayerPlanOptions options;
    options.cell_vertices = 8 + random.below(200);
    options.slab_growth = 1.5 + 4.0 * random.unit();
    options.segment_splits = 5.0 + 300.0 * random.unit();
    const LayerPlan plan = plan_layers(vertices, options);
    expect_rising_to(plan.layer_ends, vertices.size() - 1);
    expect_rising_to(plan.slab_ends, plan.layer_ends.size());
  }
}

TEST(LayerPlan, NoGenerationsNoLayers) {
  const LayerPlan plan = plan_layers(std::vector<std::uint32_t>{100}, {});
  EXPECT_TRUE(plan.layer_ends.empty());
  EXPECT_TRUE(plan.slab_ends.empty());
}

TEST(LayerPlan, ASlabEndsWhereItHasMultipliedTheVertices) {
  const LayerPlan plan = plan_layers(std::vector<std::uint32_t>{100, 200, 400, 800, 1600, 3200, 6400}, {64, 4.0, 1e9});
  EXPECT_EQ(plan.layer_ends, (std::vector<std::uint8_t>{2, 4, 6}));
  EXPECT_EQ(plan.slab_ends, (std::vector<std::uint8_t>{1, 2, 3}));
}

TEST(LayerPlan, AShortLastSlabJoinsTheOneBefore) {
  const LayerPlan plan = plan_layers(std::vector<std::uint32_t>{100, 200, 400, 600}, {64, 4.0, 1e9});
  EXPECT_EQ(plan.slab_ends.size(), 1U);
  EXPECT_EQ(plan.layer_ends, (std::vector<std::uint8_t>{3}));
}

TEST(LayerPlan, EverySegmentIsWorthItsFraming) {
  const auto vertices = growing(128, 1.3, 24);
  const LayerPlanOptions options{64, 3.5, 50.0};
  const LayerPlan plan = plan_layers(vertices, options);
  std::size_t layer = 0;
  std::uint32_t slab_begin = 0;
  for (const std::uint8_t slab_end : plan.slab_ends) {
    const double cells = std::max(1.0, std::round(vertices[slab_begin] / 64.0));
    const std::size_t first = layer;
    std::uint32_t begin = slab_begin;
    for (; layer < slab_end; ++layer) {
      const std::uint32_t end = plan.layer_ends[layer];
      // A slab with too few splits for two segments has one.
      if (slab_end - first > 1) {
        EXPECT_GE((vertices[end] - vertices[begin]) / cells, 50.0);
      }
      begin = end;
    }
    slab_begin = begin;
  }
}

}  // namespace
}  // namespace fanstream
