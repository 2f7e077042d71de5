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
    Granularity options;
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
  const LayerPlan plan =
      plan_layers(std::vector<std::uint32_t>{100, 200, 400, 800, 1600, 3200, 6400}, {64.0, 4.0, 1e9, 1.5});
  EXPECT_EQ(plan.layer_ends, (std::vector<std::uint8_t>{2, 4, 6}));
  EXPECT_EQ(plan.slab_ends, (std::vector<std::uint8_t>{1, 2, 3}));
}

TEST(LayerPlan, AShortLastSlabJoinsTheOneBefore) {
  const LayerPlan plan = plan_layers(std::vector<std::uint32_t>{100, 200, 400, 600}, {64.0, 4.0, 1e9, 1.5});
  EXPECT_EQ(plan.slab_ends.size(), 1U);
  EXPECT_EQ(plan.layer_ends, (std::vector<std::uint8_t>{3}));
}

TEST(LayerPlan, EverySegmentIsWorthItsFraming) {
  const auto vertices = growing(128, 1.3, 24);
  const Granularity options{64.0, 3.5, 50.0, 1.5};
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

TEST(DefaultGranularity, CutsLargeModelsFinelyAndSmallOnesCoarsely) {
  const auto expect = [](std::uint32_t vertices, const Granularity& expected) {
    const Granularity found = default_granularity(vertices);
    EXPECT_DOUBLE_EQ(found.cell_vertices, expected.cell_vertices) << vertices;
    EXPECT_DOUBLE_EQ(found.slab_growth, expected.slab_growth) << vertices;
    EXPECT_DOUBLE_EQ(found.segment_splits, expected.segment_splits) << vertices;
    EXPECT_DOUBLE_EQ(found.edges_per_vertex, expected.edges_per_vertex) << vertices;
    EXPECT_DOUBLE_EQ(found.evenness, expected.evenness) << vertices;
    EXPECT_DOUBLE_EQ(found.distance_growth, expected.distance_growth) << vertices;
    EXPECT_DOUBLE_EQ(found.fine_share, expected.fine_share) << vertices;
  };
  for (const std::uint32_t tiny : {0U, 3U, 999U}) expect(tiny, {48.0, 4.0, 20.0, 1.5, 0.0, 0.0, 1.0});
  for (const std::uint32_t small : {1'000U, 5'000U}) expect(small, {48.0, 4.0, 20.0, 1.5, 0.0, 1.8, 1.0});
  expect(10'000, {48.0, 4.0, 20.0, 1.5, 0.0, std::sqrt(1.8 * 1.45), 1.0});
  expect(20'000, {64.0, 4.0, 20.0, 1.65, 0.0, 1.45, 1.0});
  for (const std::uint32_t middling : {40'000U, 50'000U}) expect(middling, {64.0, 4.0, 8.0, 1.65, 1.0, 1.27, 1.0});
  for (const std::uint32_t large : {400'000U, 5'000'000U, 1U << 28U})
    expect(large, {3.7, 9.5, 1.3, 2.5, 4.0, 0.0, 0.95});
}

TEST(DefaultGranularity, ChangesSteadilyInBetween) {
  Granularity before = default_granularity(50'000);
  for (std::uint32_t vertices = 60'000; vertices <= 400'000; vertices += 10'000) {
    if (vertices == 110'000) before = default_granularity(100'001);  // from where on distances are not limited
    const Granularity now = default_granularity(vertices);
    EXPECT_LT(now.cell_vertices, before.cell_vertices) << vertices;
    EXPECT_GT(now.slab_growth, before.slab_growth) << vertices;
    EXPECT_LT(now.segment_splits, before.segment_splits) << vertices;
    EXPECT_GT(now.edges_per_vertex, before.edges_per_vertex) << vertices;
    EXPECT_GT(now.evenness, before.evenness) << vertices;
    EXPECT_LT(now.fine_share, before.fine_share) << vertices;
    EXPECT_LT(before.cell_vertices / now.cell_vertices, 1.5) << "no leap at " << vertices;
    before = now;
  }
}

}  // namespace
}  // namespace fanstream
