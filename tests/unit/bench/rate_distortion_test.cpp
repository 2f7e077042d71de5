#include "tests/bench/rate_distortion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/mesh_generators.h"
#include "tests/unit/bench/built_asset.h"

namespace fanstream::bench {
namespace {

TEST(BytesAtRms, IsStraightInLogarithmsBetweenTwoPoints) {
  const std::vector<RatePoint> curve{{100, 1e-2}, {1000, 1e-3}, {4000, 2e-4}, {9000, 0.0}};
  EXPECT_DOUBLE_EQ(*bytes_at_rms(curve, 1e-3), 1000.0);
  EXPECT_NEAR(*bytes_at_rms(curve, 1e-2 / std::sqrt(10.0)), 100.0 * std::sqrt(10.0), 1e-9);
  EXPECT_NEAR(*bytes_at_rms(curve, std::sqrt(1e-3 * 2e-4)), 2000.0, 1e-9);
  EXPECT_DOUBLE_EQ(*bytes_at_rms(curve, 0.5), 100.0);
  EXPECT_DOUBLE_EQ(*bytes_at_rms(curve, 1e-4), 9000.0);  // nothing to interpolate towards
}

TEST(BytesAtRms, WhatIsNeverReachedIsNone) {
  EXPECT_FALSE(bytes_at_rms({}, 1.0));
  const std::vector<RatePoint> curve{{100, 1e-2}, {1000, 1e-3}};
  EXPECT_FALSE(bytes_at_rms(curve, 9e-4));
}

TEST(MeasureRates, BytesRiseAsTheDistanceFallsAndThePeerKeepsIt) {
  const auto asset = built_asset(testing::make_terrain(90, 80, 3), small_cells());
  ASSERT_TRUE(asset);
  const std::vector<double> rms{4e-3, 1e-3};
  const Result<RateCurve> curve = measure_rates(asset, rms, 5'000);
  ASSERT_TRUE(curve) << curve.error().message;
  ASSERT_EQ(curve->layers.size(), asset->asset_head()->layer_ends.size() + 1);
  for (std::size_t i = 1; i < curve->layers.size(); ++i) {
    EXPECT_GT(curve->layers[i].bytes, curve->layers[i - 1].bytes);
    EXPECT_LT(curve->layers[i].rms, curve->layers[i - 1].rms);
  }
  EXPECT_EQ(curve->layers.front().bytes, static_cast<double>(asset->head().size() + asset->index().size()));
  EXPECT_NEAR(curve->layers.back().rms, 0.0, 1e-9);
  ASSERT_EQ(curve->at.size(), 2U);
  for (const RateAtRms& at : curve->at) {
    EXPECT_LE(at.peer_rms, at.rms);
    EXPECT_GT(at.peer_rms, 0.9 * at.rms);
    EXPECT_GT(at.peer_bytes, 0U);
    ASSERT_TRUE(at.layers_bytes && at.segments_bytes);
    EXPECT_LE(*at.segments_bytes, curve->layers.back().bytes);
  }
  EXPECT_LT(*curve->at[0].layers_bytes, *curve->at[1].layers_bytes);
  EXPECT_LT(*curve->at[0].segments_bytes, *curve->at[1].segments_bytes);
  EXPECT_LT(curve->at[0].peer_bytes, curve->at[1].peer_bytes);
}

}  // namespace
}  // namespace fanstream::bench
