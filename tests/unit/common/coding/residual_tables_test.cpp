#include "common/coding/residual_tables.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/exact_bytes.h"
#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::SeededRandom;

struct Case {
  float mean;
  float spread;
  std::int32_t value;
};

void expect_round_trip(const std::vector<Case>& cases) {
  const ResidualTables& tables = ResidualTables::instance();
  RansEncoder encoder;
  for (const Case& c : cases) ASSERT_EQ(tables.code(encoder, c.mean, c.spread * c.spread, c.value), c.value);
  const testing::ExactBytes bytes(encoder.finish());
  RansDecoder decoder(bytes.view());
  for (const Case& c : cases) {
    ASSERT_EQ(tables.code(decoder, c.mean, c.spread * c.spread, 0), c.value)
        << "mean " << c.mean << ", spread " << c.spread;
  }
  ASSERT_TRUE(decoder.finished_cleanly());
}

// Displacements have at most 21 bits (kMostPositionBits and a sign); sizes of the cell table at most 24.
constexpr std::int32_t kMost = (1 << 24) - 1;

std::vector<float> spreads() {
  std::vector<float> all;
  for (int quarter = -4 * 8; quarter <= 4 * 24; ++quarter) all.push_back(std::exp2(static_cast<float>(quarter) / 4.0F));
  return all;
}

TEST(ResidualTables, EveryErrorComesBackAtEverySpread) {
  for (const float spread : spreads()) {
    SCOPED_TRACE(spread);
    std::vector<Case> cases;
    for (const float mean : {0.0F, 0.2F, -0.2F, 0.4F, -0.4F, 0.5F, -0.5F, 0.75F, 1234.3F, -99.9F}) {
      for (std::int32_t error = -70; error <= 70; ++error) {
        cases.push_back({mean, spread, static_cast<std::int32_t>(mean) + error});
      }
      for (int bit = 6; bit < 24; ++bit) {
        for (const std::int32_t nudge : {-1, 0, 1}) {
          cases.push_back({mean, spread, (1 << bit) + nudge});
          cases.push_back({mean, spread, -(1 << bit) + nudge});
        }
      }
      cases.push_back({mean, spread, kMost});
      cases.push_back({mean, spread, -kMost});
    }
    expect_round_trip(cases);
  }
}

TEST(ResidualTables, RandomValuesComeBack) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    std::vector<Case> cases;
    for (int i = 0; i < 2000; ++i) {
      const float spread = std::exp2(static_cast<float>(28.0 * random.unit() - 6.0));
      const auto mean = static_cast<float>((random.unit() - 0.5) * std::exp2(23.0 * random.unit()));
      cases.push_back({mean, spread, random.between(-(1 << 20), 1 << 20)});
    }
    expect_round_trip(cases);
  }
}

// A mean that is no number is as good as 0; what lies beyond all values is cut off there.
TEST(ResidualTables, MeansThatAreNoNumbersAreSafe) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const ResidualTables& tables = ResidualTables::instance();
  for (const float spread : {0.01F, 1.0F, 77.0F, 1.0e9F}) {
    expect_round_trip({{std::numeric_limits<float>::quiet_NaN(), spread, 12}});
    for (const float mean : {kInfinity, -kInfinity, 3.0e38F, -1.0e9F}) {
      RansEncoder encoder;
      tables.code(encoder, mean, spread * spread, 5);
      const auto bytes = encoder.finish();
      RansDecoder decoder(bytes);
      tables.code(decoder, mean, spread * spread, 0);
      EXPECT_TRUE(decoder.finished_cleanly());
    }
  }
}

// Whatever a damaged model makes of it: no variance is looked up outside the tables.
TEST(ResidualTables, VariancesThatAreNoneAreSafe) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  constexpr float kNotANumber = std::numeric_limits<float>::quiet_NaN();
  for (const float variance : {0.0F, 1.0e-45F, 1.0e-38F, 3.0e38F, kInfinity, kNotANumber, -kNotANumber}) {
    RansEncoder encoder;
    ASSERT_EQ(ResidualTables::instance().code(encoder, 3.5F, variance, -77), -77);
    const testing::ExactBytes bytes(encoder.finish());
    RansDecoder decoder(bytes.view());
    ASSERT_EQ(ResidualTables::instance().code(decoder, 3.5F, variance, 0), -77) << variance;
    ASSERT_TRUE(decoder.finished_cleanly());
  }
}

TEST(ResidualTables, AnyBytesGiveABoundedValue) {
  const ResidualTables& tables = ResidualTables::instance();
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    std::vector<std::byte> noise(64);
    for (std::byte& b : noise) b = static_cast<std::byte>(random.below(256));
    const testing::ExactBytes bytes(noise);
    RansDecoder decoder(bytes.view());
    for (int i = 0; i < 60; ++i) {
      const float spread = std::exp2(static_cast<float>(40.0 * random.unit() - 10.0));
      const auto mean = static_cast<float>((random.unit() - 0.5) * std::exp2(100.0 * random.unit()));
      const std::int32_t value = tables.code(decoder, mean, spread * spread, 0);
      ASSERT_LE(std::abs(value), 1 << 28);
    }
  }
}

TEST(ResidualTables, ExpectedErrorsAreCheap) {
  SeededRandom random(3);
  for (const float spread : {0.5F, 2.0F, 11.0F, 300.0F}) {
    RansEncoder encoder;
    constexpr int kCount = 4000;
    for (int i = 0; i < kCount; ++i) {
      // The sum of twelve uniform numbers is all but normal.
      double normal = -6.0;
      for (int k = 0; k < 12; ++k) normal += random.unit();
      ResidualTables::instance().code(
          encoder, 0.25F, spread * spread,
          static_cast<std::int32_t>(std::lround(0.25 + normal * static_cast<double>(spread))));
    }
    const double bits = 8.0 * static_cast<double>(encoder.finish().size()) / kCount;
    const double ideal = std::log2(static_cast<double>(spread) * std::sqrt(2.0 * 3.14159265358979 * 2.71828182845905));
    EXPECT_LT(bits, ideal + 0.3) << "spread " << spread;
  }
}

}  // namespace
}  // namespace fanstream
