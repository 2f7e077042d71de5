#include "common/coding/ring_kernels.h"

#include <gtest/gtest.h>

#include <cstring>
#include <glm/geometric.hpp>
#include <limits>

#include "common/coding/split_coder.h"
#include "tests/unit/common/coding/random_ring.h"

namespace fanstream {
namespace {

using testing::RandomRing;
using testing::SeededRandom;

// Those that run on this machine.
std::vector<const RingKernels*> all_kernels() {
  std::vector<const RingKernels*> all{&RingKernels::portable()};
  if (RingKernels::avx2() != nullptr) all.push_back(RingKernels::avx2());
  return all;
}

Float4 unit_vector(SeededRandom& random) {
  const glm::dvec3 v(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5);
  return float4(glm::vec3(glm::normalize(v + 1e-9)));
}

Prediction random_prediction(SeededRandom& random) {
  const auto coordinate = [&] { return static_cast<float>(200.0 * (random.unit() - 0.5)); };
  const auto variance = [&] { return static_cast<float>(random.unit() * (1 << random.below(12))); };
  Prediction p{};
  p.mean = Float4{coordinate(), coordinate(), coordinate(), 0.0F};
  p.direction = random.one_in(8) ? Float4{} : p.mean;
  p.normal = unit_vector(random);
  p.variances = Float4{variance(), variance(), variance(), 0.0F};
  return p;
}

template <class T>
void add_bits(std::vector<std::uint32_t>& bits, const T& value) {
  static_assert(sizeof(T) % 4 == 0);
  std::vector<std::uint32_t> words(sizeof(T) / 4);
  std::memcpy(words.data(), &value, sizeof(T));
  bits.insert(bits.end(), words.begin(), words.end());
}

// Everything that kernels compute of a ring and of the splits of it, bit by bit.
std::vector<std::uint32_t> image(const RingKernels& kernels, const RandomRing& ring, std::uint64_t seed) {
  SeededRandom random(seed);
  std::vector<std::uint32_t> bits;
  std::vector<SplitInProgress> splits(1 + random.below(16));
  for (SplitInProgress& s : splits) s.ring.load(ring.fans, 0);
  const CodingTime time{1 + random.below(40), 40};
  for (SplitInProgress& s : splits) {
    kernels.measure(s.ring, {ring.vertices.data(), Float4{1.0F, 2.5F, 1.0F, 0.0F}});
    const RingGeometry& r = s.ring;
    bits.push_back(r.gap());
    add_bits(bits, r.normal());
    add_bits(bits, r.mean_square());
    add_bits(bits, r.bend_square());
    for (std::uint32_t i = 0; i < r.size(); ++i) add_bits(bits, r.spoke(i));
    s.length = 1 + random.below(r.size() - 1);
    s.opening = r.is_open() ? static_cast<Opening>(1 + random.below(3)) : Opening::closed;
    s.rank = s.opening == Opening::wing ? random.below(2) : random.below(r.size());
    s.split.parent = static_cast<ParentPosition>(random.below(4));
  }
  const SplitModel model;
  std::vector<Prediction> predictions;
  for (SplitInProgress& s : splits) {
    kernels.find_wings(s);
    kernels.find_free(s, time);
    predictions.push_back(kernels.predict(model.phase(1), s));
    add_bits(bits, kernels.predict_shift(model.phase(1), s, Float4{3.0F, -7.5F, 2.0F, 0.0F}));
  }
  AxisChains chains;
  kernels.chain(predictions, AxisUnits(glm::vec3(1.0F, 2.5F, 1.0F)), chains);
  std::array<std::int32_t, AxisChains::kMost> values{};
  for (std::size_t place = 0; place < 3; ++place) {
    ResidualChoices choices;
    kernels.choose(chains, place, splits.size(), choices);
    for (std::size_t i = 0; i < splits.size(); ++i) {
      add_bits(bits, choices[i]);
      values[i] = random.between(-500, 500);
    }
    kernels.to_values(choices, std::span(values).first(splits.size()));
    for (std::size_t i = 0; i < splits.size(); ++i) add_bits(bits, values[i]);
    if (place < 2) kernels.learn(chains, place, std::span(values).first(splits.size()));
  }
  for (std::size_t i = 0; i < splits.size(); ++i) {
    const SplitInProgress& s = splits[i];
    bits.insert(bits.end(), {s.split.first, s.split.last, s.root_free.count(), s.added_free.count()});
    for (std::uint32_t rank = 0; rank < s.root_free.count(); ++rank) bits.push_back(s.root_free.of_rank(rank));
    for (std::uint32_t rank = 0; rank < s.added_free.count(); ++rank) bits.push_back(s.added_free.of_rank(rank));
    for (const std::uint8_t axis : chains.order(i)) bits.push_back(axis);
    add_bits(bits, kernels.features(s.ring, s.split).features);
  }
  return bits;
}

TEST(RingKernels, AllComputeTheSameBits) {
  if (all_kernels().size() < 2) GTEST_SKIP() << "this machine runs the portable ones only";
  for (std::uint64_t seed = 0; seed < 1500; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const std::uint32_t size = random.one_in(10) ? 17 + random.below(100) : 3 + random.below(14);
    RandomRing ring(random, size, random.one_in(3), 1 << random.below(16));
    for (FanVertex& v : ring.vertices) {
      v.context.next = static_cast<std::uint8_t>(random.one_in(3) ? kNeverSplit : 1 + random.below(kMostGenerations));
    }
    ASSERT_EQ(image(RingKernels::portable(), ring, seed), image(*RingKernels::avx2(), ring, seed));
  }
}

// The same in double precision, straight from the definitions.
TEST(RingKernels, FeaturesAreWhatTheySay) {
  for (std::uint64_t seed = 0; seed < 400; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const std::uint32_t size = random.one_in(10) ? 17 + random.below(100) : 3 + random.below(14);
    const RandomRing ring(random, size, random.one_in(3), 1000);
    const RingGeometry geometry = ring.geometry(glm::vec3(1.0F));
    FanSplit split{0, random.below(size), 0, static_cast<ParentPosition>(random.below(3)), {}};
    const std::uint32_t length = 1 + random.below(size - 1);
    split.last = (split.first + length) % size;
    const bool hidden_root = split.parent == ParentPosition::added;
    const std::uint32_t first = hidden_root ? split.last : split.first;
    const std::uint32_t arc = hidden_root ? size - length : length;
    std::array<glm::dvec3, 4> means{};
    std::array<double, 4> counts{};
    for (std::uint32_t steps = 0; steps < size; ++steps) {
      const std::uint32_t i = (first + steps) % size;
      if (i == geometry.gap()) continue;
      const std::size_t feature = steps == 0 || steps == arc ? 1 : steps < arc ? 0 : 2;
      means[feature] += glm::dvec3(to_vec3(geometry.spoke(i)));
      counts[feature] += 1.0;
    }
    for (std::size_t f = 0; f < 3; ++f) means[f] /= std::max(counts[f], 1.0);
    if (arc >= 2) {
      means[3] = 0.5 * (glm::dvec3(to_vec3(geometry.spoke((first + 1) % size))) +
                        glm::dvec3(to_vec3(geometry.spoke((first + arc - 1) % size))));
    }
    for (const RingKernels* kernels : all_kernels()) {
      const RingFeatures found = kernels->features(geometry, split);
      ASSERT_EQ(found.arc, arc);
      ASSERT_EQ(found.middle, split.parent == ParentPosition::middle);
      for (std::size_t f = 0; f < 4; ++f) {
        ASSERT_NEAR(glm::distance(glm::dvec3(to_vec3(found.features[f])), means[f]), 0.0, 0.1) << kernels->name << f;
      }
    }
  }
}

TEST(RingKernels, WhatIsExpectedIsTheWeightedSumOfTheFeatures) {
  SplitStatistics statistics = SplitStatistics::built_in();
  statistics.allow_free_parents();
  statistics.free_parent.weights = {40, -17, 9, 23};
  const SplitModel model(statistics);
  for (std::uint64_t seed = 0; seed < 400; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const std::uint32_t size = random.one_in(10) ? 17 + random.below(100) : 3 + random.below(14);
    const RandomRing ring(random, size, random.one_in(3), 1000);
    const PhaseModel& phase = model.phase(static_cast<int>(random.below(CodingPhase::kPhases)));
    SplitInProgress s;
    s.ring.assign(ring.fans, 0, ring.vertices, Float4{1.0F, 1.0F, 1.0F, 0.0F});
    s.split = {0, random.below(size), 0, static_cast<ParentPosition>(random.below(4)), {}};
    s.split.last = (s.split.first + 1 + random.below(size - 1)) % size;
    for (const RingKernels* kernels : all_kernels()) {
      const RingFeatures features = kernels->features(s.ring, s.split);
      const auto context =
          static_cast<std::size_t>(PredictionContexts::index(features.middle, s.ring.is_open(), features.arc));
      const auto sum_with = [&](const std::array<float, PredictionContexts::kFeatures>& weights) {
        glm::dvec3 sum(0.0);
        for (std::size_t f = 0; f < weights.size(); ++f) {
          sum += double{weights[f]} * glm::dvec3(to_vec3(features.features[f]));
        }
        return sum;
      };
      const auto mean = glm::dvec3(to_vec3(kernels->predict(phase, s).mean));
      ASSERT_NEAR(glm::distance(mean, sum_with(phase.weights[context])), 0.0, 0.1) << kernels->name;
      const auto shift = glm::dvec3(to_vec3(kernels->predict_shift(phase, s, Float4{}).mean));
      ASSERT_NEAR(glm::distance(shift, sum_with(phase.shift_weights)), 0.0, 0.1) << kernels->name;
    }
  }
}

TEST(RingKernels, ResidualsAreChosenAsOneByOne) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinite = std::numeric_limits<float>::infinity();
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    AxisChains chains;
    for (std::size_t i = 0; i < AxisChains::kMost; ++i) {
      const auto odd = [&] {
        const std::array<float, 8> values{nan, infinite, -infinite, 0.0F, -0.0F, 0.5F, -0.25F, 1e30F};
        return values[random.below(8)];
      };
      const auto any = static_cast<float>((random.unit() - 0.5) * std::exp2(random.between(-4, 26)));
      chains.expected[1][i] = random.one_in(6) ? odd() : any;
      chains.variance[1][i] = random.one_in(10) ? odd() : static_cast<float>(std::exp2(40.0 * random.unit() - 8.0));
    }
    for (const RingKernels* kernels : all_kernels()) {
      ResidualChoices choices;
      kernels->choose(chains, 1, AxisChains::kMost, choices);
      std::array<std::int32_t, AxisChains::kMost> values{};
      std::array<std::int32_t, AxisChains::kMost> distances{};
      for (std::size_t i = 0; i < AxisChains::kMost; ++i) {
        const ResidualChoice expected = ResidualTables::choose(chains.expected[1][i], chains.variance[1][i]);
        const ResidualChoice found = choices[i];
        ASSERT_EQ(found.zero, expected.zero) << kernels->name << " " << chains.expected[1][i];
        ASSERT_EQ(found.mirror, expected.mirror) << kernels->name << " " << chains.expected[1][i];
        ASSERT_EQ(found.table, expected.table) << kernels->name << " " << chains.variance[1][i];
        ASSERT_EQ(found.raw_bits, expected.raw_bits) << kernels->name << " " << chains.variance[1][i];
        values[i] = random.between(-1 << 28, 1 << 28);
        distances[i] = expected.distance_of(values[i]);
      }
      kernels->to_values(choices, distances);
      ASSERT_EQ(distances, values) << kernels->name;
    }
  }
}

TEST(RingKernels, TheAxisAlongTheNormalIsCodedLast) {
  for (const RingKernels* kernels : all_kernels()) {
    Prediction prediction{};
    prediction.direction = Float4{1.0F, 0.0F, 0.0F, 0.0F};
    prediction.normal = Float4{0.0F, 0.0F, 1.0F, 0.0F};
    prediction.variances = Float4{9.0F, 4.0F, 0.25F, 0.0F};
    const AxisUnits units(glm::vec3(1.0F));
    AxisChains chains;
    const auto last_with = [&](Float4 normal) {
      prediction.normal = normal;
      kernels->chain(std::span(&prediction, 1), units, chains);
      return chains.order(0)[2];
    };
    ASSERT_EQ(last_with(Float4{0.0F, 0.0F, 1.0F, 0.0F}), 2);
    ASSERT_EQ(chains.order(0), (std::array<std::uint8_t, 3>{0, 1, 2}));
    ASSERT_FLOAT_EQ(chains.variance[0][0], 9.0F);
    ASSERT_FLOAT_EQ(chains.variance[1][0], 4.0F);
    ASSERT_FLOAT_EQ(chains.variance[2][0], 0.25F);
    ASSERT_EQ(chains.second_from_first[0], 0.0F);
    ASSERT_EQ(last_with(Float4{0.9F, 0.1F, 0.1F, 0.0F}), 0);
    ASSERT_EQ(last_with(Float4{0.1F, -0.9F, 0.1F, 0.0F}), 1);
    ASSERT_EQ(last_with(Float4{0.5F, 0.5F, 0.5F, 0.0F}), 0);  // the first of the largest
  }
}

// The chain is the covariance's factorisation: put together again it is the covariance.
void expect_chain_of(const Prediction& prediction, const glm::dvec3& unit, const AxisChains& chains, std::size_t at) {
  const glm::dvec3 normal(to_vec3(prediction.normal));
  const glm::dvec3 direction(to_vec3(prediction.direction));
  const glm::dvec3 along = glm::normalize(direction - glm::dot(direction, normal) * normal);
  const glm::dvec3 across = glm::cross(normal, along);
  const auto covariance = [&](std::size_t a, std::size_t b) {
    const int i = chains.order(at)[a];
    const int j = chains.order(at)[b];
    return (static_cast<double>(prediction.variances[0]) * along[i] * along[j] +
            static_cast<double>(prediction.variances[1]) * across[i] * across[j] +
            static_cast<double>(prediction.variances[2]) * normal[i] * normal[j]) /
           (unit[i] * unit[j]);
  };
  const auto variance = [&](std::size_t a) { return static_cast<double>(chains.variance[a][at]); };
  const auto l10 = static_cast<double>(chains.second_from_first[at]);
  const auto l21 = static_cast<double>(chains.third_from_second[at]);
  const double l20 = static_cast<double>(chains.third_from_first[at]) + l21 * l10;  // of the first's own share
  ASSERT_NEAR(variance(0), covariance(0, 0), 1e-4);
  ASSERT_NEAR(l10 * variance(0), covariance(1, 0), 1e-4);
  ASSERT_NEAR(l20 * variance(0), covariance(2, 0), 1e-4);
  ASSERT_NEAR(variance(1) + l10 * l10 * variance(0), covariance(1, 1), 1e-4);
  ASSERT_NEAR(l21 * variance(1) + l20 * l10 * variance(0), covariance(2, 1), 1e-4);
  ASSERT_NEAR(variance(2) + l21 * l21 * variance(1) + l20 * l20 * variance(0), covariance(2, 2), 1e-4);
}

TEST(RingKernels, ChainsStandForTheCovariances) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    std::vector<Prediction> predictions(1 + random.below(16));
    for (Prediction& p : predictions) {
      p = random_prediction(random);
      p.direction = float4(3.0F) * unit_vector(random);
      p.variances = Float4{2.0F + static_cast<float>(random.unit()), 1.0F + static_cast<float>(random.unit()),
                           0.3F + static_cast<float>(random.unit()), 0.0F};
    }
    const glm::dvec3 unit(0.5 + random.unit(), 0.5 + random.unit(), 0.5 + random.unit());
    for (const RingKernels* kernels : all_kernels()) {
      AxisChains chains;
      kernels->chain(predictions, AxisUnits(glm::vec3(unit)), chains);
      for (std::size_t i = 0; i < predictions.size(); ++i) expect_chain_of(predictions[i], unit, chains, i);
      if (HasFatalFailure()) return;
    }
  }
}

TEST(RingKernels, WhatIsPredictedDoesNotDependOnWhatIsBeside) {
  SeededRandom random(3);
  std::vector<Prediction> predictions;
  for (int i = 0; i < 16; ++i) predictions.push_back(random_prediction(random));
  const AxisUnits units(glm::vec3(1.0F, 2.0F, 0.5F));
  for (const RingKernels* kernels : all_kernels()) {
    AxisChains together;
    kernels->chain(predictions, units, together);
    for (std::size_t i = 0; i < predictions.size(); ++i) {
      AxisChains alone;
      kernels->chain(std::span(&predictions[i], 1), units, alone);
      ASSERT_EQ(alone.order(0), together.order(i));
      for (std::size_t place = 0; place < 3; ++place) {
        ASSERT_EQ(alone.expected[place][0], together.expected[place][i]);
        ASSERT_EQ(alone.variance[place][0], together.variance[place][i]);
      }
    }
  }
}

}  // namespace
}  // namespace fanstream
