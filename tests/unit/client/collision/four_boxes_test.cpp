#include "client/collision/four_boxes.h"

#include <gtest/gtest.h>

#include <glm/common.hpp>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::SeededRandom;

glm::dvec3 random_point(SeededRandom& random) { return glm::dvec3(random.unit(), random.unit(), random.unit()); }

bool holds(const Bounds& outer, const Bounds& inner) {
  return glm::min(outer.low, inner.low) == outer.low && glm::max(outer.high, inner.high) == outer.high;
}

TEST(FourBoxes, LanesAreToldBitByBit) {
  for (std::uint32_t bits = 0; bits < 16; ++bits) {
    Uint4 mask{};
    for (std::size_t k = 0; k < 4; ++k) mask[k] = ((bits >> k) & 1U) != 0 ? 0xFFFFFFFFU : 0U;
    EXPECT_EQ(lane_bits(mask), bits);
  }
}

TEST(FourBoxes, TheirSumIsTheSmallestThatHoldsThem) {
  SeededRandom random(1);
  for (int round = 0; round < 200; ++round) {
    FourBoxes four;
    FloatBox sum;
    const std::uint32_t filled = random.below(16);
    for (std::size_t k = 0; k < 4; ++k) {
      if (((filled >> k) & 1U) == 0) continue;
      FloatBox box;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        box.low[axis] = static_cast<float>(random.unit());
        box.high[axis] = box.low[axis] + static_cast<float>(random.unit());
      }
      four.set(k, box);
      EXPECT_EQ(four.box(k), box);
      sum.include(box);
    }
    EXPECT_EQ(lane_bits(four.filled()), filled);
    EXPECT_EQ(four.sum(), sum);
    EXPECT_EQ(four.sum().is_empty(), filled == 0);
  }
}

// Wherever the model lies: rounding to floats takes nothing away, and adds little.
TEST(BoxFrame, BoxesHoldWhatTheyAreAround) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const double scale = std::pow(10.0, 40.0 * random.unit() - 20.0);
    const glm::dvec3 offset = scale * std::pow(10.0, 12.0 * random.unit()) * (random_point(random) - 0.5);
    std::vector<glm::dvec3> points;
    for (int i = 0; i < 200; ++i) points.push_back(offset + scale * random_point(random));
    const PositionGrid grid = PositionGrid::fit(points, 6 + static_cast<int>(random.below(15)));
    const BoxFrame frame = BoxFrame::of(grid);
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
      const glm::dvec3 a = grid.decode(grid.encode(points[i]));
      const glm::dvec3 b = grid.decode(grid.encode(points[i + 1]));
      const Bounds box{glm::min(a, b), glm::max(a, b)};
      const Bounds rounded = frame.bounds(frame.around(box));
      EXPECT_TRUE(holds(rounded, box));
      const double added = glm::max(rounded.high.x - box.high.x, box.low.x - rounded.low.x);
      EXPECT_LE(added, frame.step * (frame.padding + 0.5) + 1e-15 * std::abs(a.x));
      const Bounds far{box.low * 1e6 - scale * 1e9, box.high * 1e6 + scale * 1e9};
      EXPECT_TRUE(holds(frame.bounds(frame.around(far)), far));
    }
  }
}

TEST(BoxFrame, NothingIsAroundNothing) {
  EXPECT_TRUE(BoxFrame{}.around(kNoBounds).is_empty());
  EXPECT_GT(BoxFrame{}.bounds({}).low.x, BoxFrame{}.bounds({}).high.x);
}

}  // namespace
}  // namespace fanstream
