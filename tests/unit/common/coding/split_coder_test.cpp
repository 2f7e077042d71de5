#include "common/coding/split_coder.h"

#include <gtest/gtest.h>

#include "tests/support/exact_bytes.h"
#include "tests/unit/common/coding/random_ring.h"

namespace fanstream {
namespace {

using testing::ExactBytes;
using testing::RandomRing;
using testing::SeededRandom;

struct CodedCase {
  RandomRing ring;
  FanSplit split;
  bool last_of_patch;
};

std::vector<CodedCase> random_cases(SeededRandom& random, int count, std::int32_t reach, std::int32_t displacement) {
  std::vector<CodedCase> cases;
  for (int i = 0; i < count; ++i) {
    const std::uint32_t size = random.one_in(20) ? 3 + random.below(200) : 3 + random.below(14);
    CodedCase c{RandomRing(random, size, random.one_in(3), reach), {}, random.one_in(2)};
    c.split.first = random.below(size);
    c.split.last = (c.split.first + 1 + random.below(size - 1)) % size;
    c.split.parent = static_cast<ParentPosition>(random.below(3));
    const auto coordinate = [&] { return random.between(-displacement, displacement); };
    c.split.displacement = {coordinate(), coordinate(), coordinate()};
    cases.push_back(std::move(c));
  }
  return cases;
}

void expect_round_trip(const std::vector<CodedCase>& cases, const SplitModel& model, const glm::vec3& unit) {
  RansEncoder encoder;
  for (const CodedCase& c : cases) {
    FanSplit split = c.split;
    code_split(encoder, model, c.ring.geometry(unit), unit, c.last_of_patch, split);
    ASSERT_EQ(split.first, c.split.first);
    ASSERT_EQ(split.displacement, c.split.displacement);
  }
  const ExactBytes bytes(encoder.finish());
  RansDecoder decoder(bytes.view());
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const CodedCase& c = cases[i];
    FanSplit split{0, 0, 1, ParentPosition::kept, {}};
    code_split(decoder, model, c.ring.geometry(unit), unit, c.last_of_patch, split);
    ASSERT_EQ(split.first, c.split.first) << "split " << i;
    ASSERT_EQ(split.last, c.split.last) << "split " << i;
    ASSERT_EQ(split.parent, c.split.parent) << "split " << i;
    ASSERT_EQ(split.displacement, c.split.displacement) << "split " << i;
  }
  ASSERT_TRUE(decoder.finished_cleanly());
}

TEST(SplitCoder, SplitsComeBack) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const std::int32_t reach = 1 << random.below(12);
    const SplitModel model;
    expect_round_trip(random_cases(random, 150, reach, reach), model, glm::vec3(1.0F));
  }
}

TEST(SplitCoder, SplitsAcrossTheWholeGridComeBackOnAnisotropicGrids) {
  constexpr std::int32_t kFar = (1 << 20) - 1;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const SplitModel model;
    expect_round_trip(random_cases(random, 100, kFar / 2, kFar), model, glm::vec3(1.0F, 1.0F, 40.0F));
    expect_round_trip(random_cases(random, 100, 3, kFar), model, glm::vec3(1.0F, 1000.0F, 1.0F));
  }
}

TEST(SplitCoder, SplitsComeBackWithOtherStatistics) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    SplitStatistics statistics;
    for (auto& table : statistics.symbols) {
      for (std::uint8_t& share : table) share = static_cast<std::uint8_t>(random.below(32));
    }
    for (auto& weights : statistics.weights) {
      for (std::int8_t& w : weights) w = static_cast<std::int8_t>(random.between(-128, 127));
    }
    statistics.spreads = SplitStatistics::built_in().spreads;
    for (std::int8_t& s : statistics.spreads) s = static_cast<std::int8_t>(s + random.between(-8, 8));
    const SplitModel model(statistics);
    expect_round_trip(random_cases(random, 100, 300, 300), model, glm::vec3(1.0F, 2.0F, 1.0F));
  }
}

TEST(SplitCoder, EveryArcOfEveryRingComesBack) {
  const SplitModel model;
  SeededRandom random(11);
  std::vector<CodedCase> cases;
  for (std::uint32_t size = 3; size <= 9; ++size) {
    for (const bool open : {false, true}) {
      for (std::uint32_t first = 0; first < size; ++first) {
        for (std::uint32_t step = 1; step < size; ++step) {
          for (int parent = 0; parent < 3; ++parent) {
            CodedCase c{RandomRing(random, size, open, 20), {}, step == 1};
            c.split = {0, first, (first + step) % size, static_cast<ParentPosition>(parent), {1, -2, 3}};
            cases.push_back(std::move(c));
          }
        }
      }
    }
  }
  expect_round_trip(cases, model, glm::vec3(1.0F));
}

TEST(SplitCoder, AnyBytesGiveALegalSplit) {
  const SplitModel model;
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    std::vector<std::byte> noise(random.below(200));
    for (std::byte& b : noise) b = static_cast<std::byte>(random.below(256));
    const ExactBytes bytes(noise);
    RansDecoder decoder(bytes.view());
    for (const CodedCase& c : random_cases(random, 30, 50, 0)) {
      FanSplit split{0, 0, 1, ParentPosition::kept, {}};
      const RingGeometry ring = c.ring.geometry(glm::vec3(1.0F));
      code_split(decoder, model, ring, glm::vec3(1.0F), c.last_of_patch, split);
      ASSERT_LT(split.first, ring.size());
      ASSERT_LT(split.last, ring.size());
      ASSERT_NE(split.first, split.last);
      ASSERT_LE(static_cast<int>(split.parent), 2);
      for (int axis = 0; axis < 3; ++axis) ASSERT_LE(std::abs(split.displacement[axis]), 1 << 28);
    }
  }
}

TEST(SplitCoder, PredictionsFollowTheRing) {
  // Features are sums of spokes, so a ring twice as large predicts a place twice as far.
  const SplitModel model;
  SeededRandom random(5);
  RandomRing small(random, 6, false, 64);
  RandomRing large = small;
  for (GridPoint& p : large.places) p = 2 * p;
  const FanSplit split{0, 1, 3, ParentPosition::kept, {}};
  const RingGeometry a = small.geometry(glm::vec3(1.0F));
  const RingGeometry b = large.geometry(glm::vec3(1.0F));
  EXPECT_EQ(2.0F * to_vec3(predict(model, a, ring_features(a, split)).mean),
            to_vec3(predict(model, b, ring_features(b, split)).mean));
}

TEST(SplitCoder, TheAxisAlongTheNormalIsCodedLast) {
  Prediction prediction;
  prediction.along = Float4{1.0F, 0.0F, 0.0F, 0.0F};
  prediction.spread_along = 3.0F;
  prediction.spread_across = 2.0F;
  prediction.spread_normal = 0.5F;
  const AxisChain chain = chain_axes(prediction, Float4{0.0F, 0.0F, 1.0F, 0.0F}, glm::vec3(1.0F));
  EXPECT_EQ(chain.order, (std::array<int, 3>{0, 1, 2}));
  EXPECT_FLOAT_EQ(chain.spread[0], 3.0F);
  EXPECT_FLOAT_EQ(chain.spread[1], 2.0F);
  EXPECT_FLOAT_EQ(chain.spread[2], 0.5F);
  EXPECT_EQ(chain.second_from_first, 0.0F);
  EXPECT_EQ(chain_axes(prediction, Float4{0.9F, 0.1F, 0.1F, 0.0F}, glm::vec3(1.0F)).order[2], 0);
}

}  // namespace
}  // namespace fanstream
