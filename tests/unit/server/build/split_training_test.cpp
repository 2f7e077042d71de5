#include "server/build/split_training.h"

#include <gtest/gtest.h>

#include <glm/common.hpp>

#include "server/build/asset_builder.h"
#include "tests/support/mesh_generators.h"
#include "tests/unit/common/coding/random_ring.h"

namespace fanstream {
namespace {

using testing::RandomRing;
using testing::SeededRandom;

double cost_bits(const CountingCoder::Counts& counts, const SplitStatistics& statistics) {
  double bits = 0.0;
  for (std::size_t t = 0; t < counts.size(); ++t) {
    const FrequencyTable table =
        table_of(std::span(statistics.symbols[t])
                     .first(static_cast<std::size_t>(SymbolContexts::table_symbol_count(static_cast<int>(t)))));
    for (int s = 0; s < table.symbol_count(); ++s) {
      bits += counts[t][static_cast<std::size_t>(s)] * table.cost_bits(s);
    }
  }
  return bits;
}

double written_bits(const SplitStatistics& statistics) {
  ByteWriter out;
  statistics.write(out);
  return 8.0 * static_cast<double>(out.size());
}

TEST(SplitTraining, LearnedSymbolsSaveMoreThanTheyCost) {
  for (const TriangleMesh& mesh :
       {testing::make_terrain(60, 60, 1), testing::make_torus(60, 50), testing::make_grid(50, 50)}) {
    const auto sample = sample_splits(mesh, {});
    ASSERT_TRUE(sample) << sample.error().message;
    SplitStatistics learned = SplitStatistics::built_in();
    const CountingCoder::Counts counts = tied_counts(sample->counts);
    learn_symbols(counts, learned);
    EXPECT_NE(learned.symbols, SplitStatistics::built_in().symbols);
    const double before = cost_bits(counts, SplitStatistics::built_in());
    const double after = cost_bits(counts, learned);
    EXPECT_LT(after + written_bits(learned), before + written_bits(SplitStatistics::built_in()));
  }
}

TEST(SplitTraining, NothingSeenNothingLearned) {
  SplitStatistics statistics = SplitStatistics::built_in();
  learn_symbols(CountingCoder::Counts(SymbolContexts::kTables), statistics);
  GeometryTraining(0).learn(statistics);
  EXPECT_EQ(statistics.symbols, SplitStatistics::built_in().symbols);
  EXPECT_EQ(statistics.weights, SplitStatistics::built_in().weights);
  EXPECT_EQ(statistics.spreads, SplitStatistics::built_in().spreads);
}

TEST(SplitTraining, FindsTheWeightsThatWereUsed) {
  constexpr int kPhase = 2;
  const std::array<int, 4> wanted{24, 40, -8, 16};
  GeometryTraining training(1);
  SeededRandom random(6);
  const FanSplit shape{0, 1, 5, ParentPosition::kept, {}};  // arcs below 4 have features that are alike
  for (int i = 0; i < 800; ++i) {
    const RandomRing ring(random, 7, false, 4000);
    const RingGeometry geometry = ring.geometry(glm::vec3(1.0F));
    const RingFeatures features = ring_features(geometry, shape);
    glm::vec3 place(0.0F);
    for (std::size_t f = 0; f < 4; ++f) place += static_cast<float>(wanted[f]) / 64.0F * to_vec3(features.features[f]);
    FanSplit split = shape;
    split.displacement = GridPoint(glm::round(place));
    training.observe(geometry, split, glm::vec3(1.0F), kPhase);
  }
  SplitStatistics learned = SplitStatistics::built_in();
  training.learn(learned);
  const auto& weights = learned.weights[SplitStatistics::class_of(kPhase, PredictionContexts::index(false, false, 4))];
  for (std::size_t f = 0; f < 4; ++f) EXPECT_NEAR(weights[f], wanted[f], 1) << f;
  // Of a few of them it is not worth while to tell.
  GeometryTraining few(1);
  few.add(training, 4);
  SplitStatistics unchanged = SplitStatistics::built_in();
  few.learn(unchanged);
  EXPECT_EQ(unchanged.weights, SplitStatistics::built_in().weights);
}

TEST(SplitTraining, ContextsAddUpToTheTablesThatTheyShare) {
  const SplitModel untied = SplitModel::untied();
  CountingCoder counter(untied);
  std::vector<double> wanted(SymbolContexts::kTables, 0.0);
  for (int p = 0; p < CodingPhase::kPhases; ++p) {
    for (int c = 0; c < SymbolContexts::kContexts; ++c) {
      counter.symbol(untied.phase(p).table(static_cast<std::size_t>(c)), 1);
      wanted[static_cast<std::size_t>(SymbolContexts::table_of(p, c))] += 1.0;
    }
  }
  const CountingCoder::Counts counts = tied_counts(counter.counts());
  ASSERT_EQ(counts.size(), wanted.size());
  for (std::size_t t = 0; t < wanted.size(); ++t) EXPECT_EQ(counts[t][1], wanted[t]) << t;
}

TEST(SplitTraining, TheCountingCoderCountsEverySymbolOnce) {
  const SplitModel model;
  CountingCoder counter(model);
  const PhaseModel& phase = model.phase(3);
  const std::size_t three = model.index_of(phase.table(3));
  const std::size_t ten = model.index_of(phase.table(10));
  ASSERT_NE(three, ten);
  counter.symbol(phase.table(3), 2);
  counter.symbol(phase.table(3), 2);
  counter.symbol(phase.table(10), 0);
  EXPECT_EQ(counter.bits(5, 17), 17U);
  EXPECT_EQ(counter.counts()[three][2], 2.0);
  EXPECT_EQ(counter.counts()[ten][0], 1.0);
  const FrequencyTable other(4);  // not one of the model's: the residuals'
  counter.symbol(other, 1);
  double total = 0.0;
  for (const auto& table : counter.counts()) {
    for (const double count : table) total += count;
  }
  EXPECT_EQ(total, 3.0);
}

}  // namespace
}  // namespace fanstream
