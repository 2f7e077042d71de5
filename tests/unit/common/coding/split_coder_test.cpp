#include "common/coding/split_coder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>

#include "common/refine/cell_coder.h"
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

// The splits of `cases` as they go into a coder: as an encoder gets them, or as a decoder does, which knows the rings
// only.
std::vector<SplitInProgress> in_progress(const std::vector<CodedCase>& cases, const glm::vec3& unit, bool known) {
  std::vector<SplitInProgress> all(cases.size());
  for (std::size_t i = 0; i < cases.size(); ++i) {
    all[i].ring.assign(cases[i].ring.fans, 0, cases[i].ring.vertices, float4(unit));
    all[i].split = known ? cases[i].split : FanSplit{0, 0, 1, ParentPosition::kept, {}};
    all[i].last_of_patch = cases[i].last_of_patch;
  }
  return all;
}

template <class Coder>
void code_by_batches(Coder& coder, const SplitModel& model, const glm::vec3& unit, std::vector<SplitInProgress>& splits,
                     std::size_t batch) {
  for (std::size_t begin = 0; begin < splits.size(); begin += batch) {
    code_splits(coder, model, AxisUnits(unit),
                std::span(splits).subspan(begin, std::min(batch, splits.size() - begin)));
  }
}

void expect_splits(const std::vector<SplitInProgress>& found, const std::vector<CodedCase>& cases) {
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const FanSplit& expected = cases[i].split;
    ASSERT_EQ(found[i].split.first, expected.first) << "split " << i;
    ASSERT_EQ(found[i].split.last, expected.last) << "split " << i;
    ASSERT_EQ(found[i].split.parent, expected.parent) << "split " << i;
    ASSERT_EQ(found[i].split.displacement, expected.displacement) << "split " << i;
  }
}

void expect_round_trip(const std::vector<CodedCase>& cases, const SplitModel& model, const glm::vec3& unit,
                       std::size_t batch = CellCoding::kBatch) {
  RansEncoder encoder;
  std::vector<SplitInProgress> given = in_progress(cases, unit, true);
  code_by_batches(encoder, model, unit, given, batch);
  expect_splits(given, cases);
  const ExactBytes bytes(encoder.finish());
  RansDecoder decoder(bytes.view());
  std::vector<SplitInProgress> found = in_progress(cases, unit, false);
  code_by_batches(decoder, model, unit, found, batch);
  expect_splits(found, cases);
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

TEST(SplitCoder, SplitsComeBackFromBatchesOfAnySize) {
  for (std::size_t batch = 1; batch <= CellCoding::kBatch; ++batch) {
    SCOPED_TRACE("batches of " + std::to_string(batch));
    SeededRandom random(batch);
    const SplitModel model;
    for (const int count : {0, 1, 7, 16, 17, 100}) {
      expect_round_trip(random_cases(random, count, 90, 90), model, glm::vec3(1.0F, 1.0F, 2.0F), batch);
      if (HasFatalFailure()) return;
    }
  }
}

// Which symbols of which tables it was given, in order.
struct RecordingCoder {
  static constexpr bool kDecodes = false;
  std::vector<std::pair<const FrequencyTable*, int>> steps;
  int symbol(const FrequencyTable& table, int value) {
    steps.emplace_back(&table, value);
    return value;
  }
  unsigned bits(int count, unsigned value) {
    if (count != 0) steps.emplace_back(nullptr, static_cast<int>(value) << 4 | count);
    return value;
  }
};

// Only the order of symbols differs: what is predicted for a split does not depend on those beside it.
TEST(SplitCoder, BatchesOfAnySizeCodeTheSameSymbols) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const SplitModel model;
    const auto cases = random_cases(random, 100, 300, 300);
    std::vector<std::pair<const FrequencyTable*, int>> expected;
    for (std::size_t batch = 1; batch <= CellCoding::kBatch; ++batch) {
      RecordingCoder coder;
      std::vector<SplitInProgress> splits = in_progress(cases, glm::vec3(1.0F), true);
      code_by_batches(coder, model, glm::vec3(1.0F), splits, batch);
      std::sort(coder.steps.begin(), coder.steps.end());
      if (batch == 1) expected = coder.steps;
      ASSERT_TRUE(coder.steps == expected) << "batches of " << batch;
    }
  }
}

// What a batch held before must not show: they are used again and again.
TEST(SplitCoder, ABatchCanBeUsedAgain) {
  const SplitModel model;
  const glm::vec3 unit(1.0F);
  SeededRandom random(14);
  const auto cases = random_cases(random, 400, 200, 200);
  RansEncoder encoder;
  std::vector<SplitInProgress> given = in_progress(cases, unit, true);
  code_by_batches(encoder, model, unit, given, 16);
  const ExactBytes bytes(encoder.finish());
  RansDecoder decoder(bytes.view());
  std::array<SplitInProgress, 16> batch;
  for (std::size_t begin = 0; begin < cases.size(); begin += batch.size()) {
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const CodedCase& c = cases[begin + i];
      batch[i].ring.assign(c.ring.fans, 0, c.ring.vertices, float4(unit));
      batch[i].last_of_patch = c.last_of_patch;
    }
    code_splits(decoder, model, AxisUnits(unit), std::span(batch));
    for (std::size_t i = 0; i < batch.size(); ++i) {
      ASSERT_EQ(batch[i].split.first, cases[begin + i].split.first);
      ASSERT_EQ(batch[i].split.last, cases[begin + i].split.last);
      ASSERT_EQ(batch[i].split.displacement, cases[begin + i].split.displacement);
    }
  }
  ASSERT_TRUE(decoder.finished_cleanly());
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
    std::vector<SplitInProgress> splits = in_progress(random_cases(random, 30, 50, 0), glm::vec3(1.0F), false);
    code_by_batches(decoder, model, glm::vec3(1.0F), splits, 1 + random.below(16));
    for (const SplitInProgress& s : splits) {
      ASSERT_LT(s.split.first, s.ring.size());
      ASSERT_LT(s.split.last, s.ring.size());
      ASSERT_NE(s.split.first, s.split.last);
      ASSERT_LE(static_cast<int>(s.split.parent), 2);
      for (int axis = 0; axis < 3; ++axis) ASSERT_LE(std::abs(s.split.displacement[axis]), 1 << 28);
    }
  }
}

TEST(SplitCoder, PredictionsFollowTheRing) {
  // Features are sums of spokes, so a ring twice as large predicts a place twice as far.
  const SplitModel model;
  SeededRandom random(5);
  RandomRing small(random, 6, false, 64);
  RandomRing large = small;
  for (FanVertex& v : large.vertices) v.place = 2 * v.place;
  const FanSplit split{0, 1, 3, ParentPosition::kept, {}};
  const RingGeometry a = small.geometry(glm::vec3(1.0F));
  const RingGeometry b = large.geometry(glm::vec3(1.0F));
  EXPECT_EQ(2.0F * to_vec3(predict(model, a, ring_features(a, split)).mean),
            to_vec3(predict(model, b, ring_features(b, split)).mean));
}

TEST(SplitCoder, TheAxisAlongTheNormalIsCodedLast) {
  Prediction prediction;
  prediction.along = Float4{1.0F, 0.0F, 0.0F, 0.0F};
  prediction.variance_along = 9.0F;
  prediction.variance_across = 4.0F;
  prediction.variance_normal = 0.25F;
  const AxisUnits units(glm::vec3(1.0F));
  AxisChain chain;
  chain_axes(prediction, Float4{0.0F, 0.0F, 1.0F, 0.0F}, units, chain);
  EXPECT_EQ(chain.order, (std::array<int, 3>{0, 1, 2}));
  EXPECT_FLOAT_EQ(chain.variance[0], 9.0F);
  EXPECT_FLOAT_EQ(chain.variance[1], 4.0F);
  EXPECT_FLOAT_EQ(chain.variance[2], 0.25F);
  EXPECT_EQ(chain.second_from_first, 0.0F);
  chain_axes(prediction, Float4{0.9F, 0.1F, 0.1F, 0.0F}, units, chain);
  EXPECT_EQ(chain.order[2], 0);
  chain_axes(prediction, Float4{0.1F, -0.9F, 0.1F, 0.0F}, units, chain);
  EXPECT_EQ(chain.order[2], 1);
  chain_axes(prediction, Float4{0.5F, 0.5F, 0.5F, 0.0F}, units, chain);
  EXPECT_EQ(chain.order[2], 0);  // the first of the largest
}

// The chain is the covariance's factorisation: put together again it is the covariance.
TEST(SplitCoder, TheChainStandsForTheCovariance) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const auto direction = [&] {
      return glm::normalize(glm::dvec3(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5) + 1e-9);
    };
    const glm::dvec3 normal = direction();
    const glm::dvec3 along = glm::normalize(glm::cross(normal, direction()));
    const glm::dvec3 across = glm::cross(normal, along);
    const glm::dvec3 unit(0.5 + random.unit(), 0.5 + random.unit(), 0.5 + random.unit());
    Prediction prediction;
    prediction.along = float4(glm::vec3(3.0 * along));
    prediction.variance_along = 2.0F + static_cast<float>(random.unit());
    prediction.variance_across = 1.0F + static_cast<float>(random.unit());
    prediction.variance_normal = 0.3F + static_cast<float>(random.unit());
    AxisChain chain;
    chain_axes(prediction, float4(glm::vec3(normal)), AxisUnits(glm::vec3(unit)), chain);
    const auto covariance = [&](std::size_t a, std::size_t b) {
      const int i = chain.order[a];
      const int j = chain.order[b];
      return (static_cast<double>(prediction.variance_along) * along[i] * along[j] +
              static_cast<double>(prediction.variance_across) * across[i] * across[j] +
              static_cast<double>(prediction.variance_normal) * normal[i] * normal[j]) /
             (unit[i] * unit[j]);
    };
    const auto variance = [&](std::size_t a) { return static_cast<double>(chain.variance[a]); };
    const double l10 = static_cast<double>(chain.second_from_first);
    const double l21 = static_cast<double>(chain.third_from_second);
    const double l20 = static_cast<double>(chain.third_from_first) + l21 * l10;  // of the first's own share
    ASSERT_NEAR(variance(0), covariance(0, 0), 1e-4);
    ASSERT_NEAR(l10 * variance(0), covariance(1, 0), 1e-4);
    ASSERT_NEAR(l20 * variance(0), covariance(2, 0), 1e-4);
    ASSERT_NEAR(variance(1) + l10 * l10 * variance(0), covariance(1, 1), 1e-4);
    ASSERT_NEAR(l21 * variance(1) + l20 * l10 * variance(0), covariance(2, 1), 1e-4);
    ASSERT_NEAR(variance(2) + l21 * l21 * variance(1) + l20 * l20 * variance(0), covariance(2, 2), 1e-4);
  }
}

}  // namespace
}  // namespace fanstream
