#include "common/coding/split_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "tests/support/exact_bytes.h"
#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::ExactBytes;
using testing::SeededRandom;

std::vector<std::byte> written(const SplitStatistics& statistics) {
  ByteWriter out;
  statistics.write(out);
  return out.take();
}

void expect_equal(const SplitStatistics& a, const SplitStatistics& b) {
  for (int t = 0; t < SymbolContexts::kTables; ++t) {
    const auto table = static_cast<std::size_t>(t);
    for (std::size_t s = 0; s < static_cast<std::size_t>(SymbolContexts::table_symbol_count(t)); ++s) {
      ASSERT_EQ(a.symbols[table][s], b.symbols[table][s]) << "table " << t << ", symbol " << s;
    }
  }
  ASSERT_EQ(a.weights, b.weights);
  ASSERT_EQ(a.scales, b.scales);
  ASSERT_EQ(a.spreads, b.spreads);
  ASSERT_EQ(a.has_free_parents, b.has_free_parents);
  if (!a.has_free_parents) return;
  for (std::size_t t = 0; t < a.symbols.size(); ++t) {
    if (!SymbolContexts::is_of_parents(static_cast<int>(t))) continue;
    ASSERT_EQ(a.symbols[t][3], b.symbols[t][3]);
  }
  ASSERT_EQ(a.free_parent, b.free_parent);
}

SplitStatistics random_statistics(SeededRandom& random, std::uint32_t changed_one_in) {
  SplitStatistics s = SplitStatistics::built_in();
  for (auto& table : s.symbols) {
    if (!random.one_in(changed_one_in)) continue;
    const std::size_t count = random.one_in(2) ? table.size() : 1 + random.below(32);  // the rest as built in
    for (std::size_t i = 0; i < count; ++i) table[i] = static_cast<std::uint8_t>(random.below(64));
  }
  for (auto& weights : s.weights) {
    if (!random.one_in(changed_one_in)) continue;
    for (std::int8_t& w : weights) w = static_cast<std::int8_t>(random.between(-128, 127));
  }
  for (std::int8_t& scale : s.scales) {
    if (random.one_in(changed_one_in)) scale = static_cast<std::int8_t>(random.between(-64, 127));
  }
  for (std::int8_t& spread : s.spreads) {
    if (random.one_in(changed_one_in)) spread = static_cast<std::int8_t>(random.between(-64, 127));
  }
  if (random.one_in(2)) return s;
  s.has_free_parents = true;
  for (std::size_t t = 0; t < s.symbols.size(); ++t) {
    if (SymbolContexts::is_of_parents(static_cast<int>(t)))
      s.symbols[t][3] = static_cast<std::uint8_t>(random.below(64));
  }
  for (std::int8_t& w : s.free_parent.weights) w = static_cast<std::int8_t>(random.between(-128, 127));
  for (std::int8_t& spread : s.free_parent.spreads) spread = static_cast<std::int8_t>(random.between(-64, 127));
  return s;
}

TEST(SplitModel, StatisticsComeBack) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const SplitStatistics statistics = random_statistics(random, 1 + random.below(20));
    const ExactBytes bytes(written(statistics));
    ByteReader in(bytes.view());
    const Result<SplitStatistics> read = SplitStatistics::read(in);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(in.remaining(), 0U);
    expect_equal(*read, statistics);
  }
}

TEST(SplitModel, BuiltInStatisticsTakeFewBytes) {
  const auto bytes = written(SplitStatistics::built_in());
  EXPECT_LT(bytes.size(), 40U);
  ByteReader in(bytes);
  const Result<SplitStatistics> read = SplitStatistics::read(in);
  ASSERT_TRUE(read);
  expect_equal(*read, SplitStatistics::built_in());
}

TEST(SplitModel, TablesThatWereNotWrittenAreTheBuiltInOnes) {
  const SplitModel built_in;
  for (const bool free_parents : {false, true}) {
    SplitStatistics statistics = SplitStatistics::built_in();
    if (free_parents) statistics.allow_free_parents();
    for (std::uint8_t& share : statistics.symbols[7]) share = 3;
    const auto bytes = written(statistics);
    ByteReader in(bytes);
    const Result<SplitStatistics> read = SplitStatistics::read(in);
    ASSERT_TRUE(read) << read.error().message;
    const SplitModel model(*read);
    for (int phase = 0; phase < CodingPhase::kPhases; ++phase) {
      for (int context = 0; context < SymbolContexts::kContexts; ++context) {
        const int t = SymbolContexts::table_of(phase, context);
        const bool own = t == 7 || (free_parents && SymbolContexts::is_of_parents(t));
        const auto c = static_cast<std::size_t>(context);
        EXPECT_EQ(&model.phase(phase).table(c) != &built_in.phase(phase).table(c), own) << "table " << t;
      }
    }
  }
}

TEST(SplitModel, EveryTruncationIsAnErrorThatNamesTheByte) {
  SeededRandom random(8);
  const auto bytes = written(random_statistics(random, 12));
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const ExactBytes shorter{std::span(bytes).first(size)};
    ByteReader in(shorter.view());
    const Result<SplitStatistics> read = SplitStatistics::read(in);
    ASSERT_FALSE(read) << "cut to " << size;
    EXPECT_NE(read.error().message.find("byte"), std::string::npos) << read.error().message;
  }
}

void expect_tables_of_contexts(const SplitModel& model, bool free_parents) {
  for (int p = 0; p < CodingPhase::kPhases; ++p) {
    for (int c = 0; c < SymbolContexts::kContexts; ++c) {
      const FrequencyTable& table = model.phase(p).table(static_cast<std::size_t>(c));
      ASSERT_EQ(table.symbol_count(), SymbolContexts::symbol_count(c, free_parents)) << p << ", " << c;
      ASSERT_EQ(model.index_of(table), static_cast<std::size_t>(SymbolContexts::table_of(p, c))) << p << ", " << c;
    }
  }
}

TEST(SplitModel, DamageIsAnErrorOrStatisticsInRange) {
  SeededRandom random(9);
  ExactBytes bytes(written(random_statistics(random, 12)));
  for (std::size_t bit = 0; bit < bytes.view().size() * 8; ++bit) {
    bytes.flip(bit);
    ByteReader in(bytes.view());
    const Result<SplitStatistics> read = SplitStatistics::read(in);
    if (read) {
      for (int t = 0; t < SymbolContexts::kTables; ++t) {
        for (int s = 0; s < SymbolContexts::table_symbol_count(t); ++s) {
          ASSERT_LE(read->symbols[static_cast<std::size_t>(t)][static_cast<std::size_t>(s)], 63);
        }
      }
      const SplitModel model(*read);  // and a model can be made of them
      expect_tables_of_contexts(model, read->has_free_parents);
    }
    bytes.flip(bit);
  }
}

TEST(SplitModel, CodedSharesStandForTheFrequencies) {
  const std::vector<double> counts{50, 1000, 0, 200, 3};
  double sum = 0.0;
  for (const double c : counts) sum += c;
  std::vector<std::uint8_t> shares;
  for (const double c : counts) shares.push_back(coded_share(c, sum));
  EXPECT_EQ(shares[2], 63);
  const FrequencyTable table = table_of(shares);
  for (std::size_t s = 0; s < counts.size(); ++s) {
    // An eighth of a bit either way, then all shares are made to add up.
    const double share = table.frequency(static_cast<int>(s)) / double{FrequencyTable::kTotal};
    EXPECT_NEAR(share, counts[s] / sum, 0.15 * counts[s] / sum + 0.001) << s;
  }
}

TEST(SplitModel, EveryContextHasItsOwnNumber) {
  std::vector<int> seen(SymbolContexts::kContexts, 0);
  const auto see = [&](int context, int symbols) {
    ASSERT_GE(context, 0);
    ASSERT_LT(context, SymbolContexts::kContexts);
    ASSERT_EQ(SymbolContexts::symbol_count(context), symbols);
    ++seen[static_cast<std::size_t>(context)];
  };
  for (std::uint32_t size = 0; size < 300; ++size) {
    see(SymbolContexts::opening(size), 4);
    for (int o = 0; o < 4; ++o) see(SymbolContexts::length(static_cast<Opening>(o), size), 32);
    for (std::uint32_t length = 1; length < 40; ++length) see(SymbolContexts::rank(size, length), 32);
  }
  for (const bool last : {false, true}) {
    for (const bool open : {false, true}) see(SymbolContexts::parent(last, open), 3);
  }
  for (std::uint32_t valence = 0; valence < 300; ++valence) {
    see(SymbolContexts::next_split(NextSplitOf::base, 1 + valence % 64, false, valence), 32);
    for (std::uint32_t free = 1; free <= 64; ++free) {
      for (const bool taken : {false, true}) {
        for (const NextSplitOf whose : {NextSplitOf::root, NextSplitOf::added}) {
          see(SymbolContexts::next_split(whose, free, taken, valence), free < 6 ? static_cast<int>(free) + 1 : 32);
        }
      }
    }
  }
  for (std::size_t c = 0; c < seen.size(); ++c) EXPECT_GT(seen[c], 0) << "context " << c << " is never used";
}

TEST(SplitModel, ContextsShareTablesOfTheirKind) {
  std::vector<int> contexts(SymbolContexts::kTables, 0);
  for (int p = 0; p < CodingPhase::kPhases; ++p) {
    for (int c = 0; c < SymbolContexts::kContexts; ++c) {
      const int table = SymbolContexts::table_of(p, c);
      ASSERT_LT(table, SymbolContexts::kTables);
      EXPECT_EQ(SymbolContexts::is_of_parents(table), c >= SymbolContexts::kParentFirst) << p << ", " << c;
      for (const bool free_parents : {false, true}) {
        EXPECT_EQ(SymbolContexts::table_symbol_count(table, free_parents),
                  SymbolContexts::symbol_count(c, free_parents))
            << p << ", " << c;
      }
      ++contexts[static_cast<std::size_t>(table)];
    }
  }
  for (std::size_t t = 0; t < contexts.size(); ++t) EXPECT_GT(contexts[t], 0) << "table " << t << " is never used";
}

TEST(SplitModel, AnUntiedModelHasATableForEveryContextOfEveryPhase) {
  const SplitModel untied = SplitModel::untied();
  const SplitModel tied;
  std::size_t number = 0;
  for (int p = 0; p < CodingPhase::kPhases; ++p) {
    for (std::size_t c = 0; c < SymbolContexts::kContexts; ++c) {
      const FrequencyTable& table = untied.phase(p).table(c);
      ASSERT_EQ(untied.index_of(table), number++);
      for (int s = 0; s < table.symbol_count(); ++s) {
        ASSERT_EQ(table.frequency(s), tied.phase(p).table(c).frequency(s));
      }
    }
  }
  EXPECT_EQ(untied.table_count(), number);
  EXPECT_EQ(untied.index_of(tied.phase(0).table(0)), untied.table_count());
}

TEST(SplitModel, TheLastGenerationsArePhasesOfTheirOwn) {
  const std::vector<int> phases{0, 1, 2, 2, 3, 3};
  for (std::uint32_t left = 0; left < phases.size(); ++left) {
    EXPECT_EQ(CodingPhase::of(20 - left, 20), phases[left]) << left;
  }
  const SplitModel model;
  EXPECT_EQ(&model.at(24, 24), &model.phase(0));
  EXPECT_EQ(&model.at(1, 24), &model.phase(CodingPhase::kFirst));
}

// What one of few free generations can be is told apart by all that is known of it.
TEST(SplitModel, NextSplitsAreToldApart) {
  std::set<int> numbers;
  std::size_t contexts = 0;
  for (std::uint32_t valence = 3; valence <= 14; ++valence) {
    numbers.insert(SymbolContexts::next_split(NextSplitOf::base, 9, false, valence));
    ++contexts;
    for (std::uint32_t free = 1; free <= SymbolContexts::kManyFree; ++free) {
      for (const bool taken : {false, true}) {
        for (const NextSplitOf whose : {NextSplitOf::root, NextSplitOf::added}) {
          numbers.insert(SymbolContexts::next_split(whose, free, taken, valence));
          ++contexts;
        }
      }
    }
  }
  EXPECT_EQ(numbers.size(), contexts);
  EXPECT_LT(*numbers.rbegin(), SymbolContexts::kOpeningFirst);
}

TEST(SplitModel, SpreadContextsAreInRange) {
  for (const float square : {0.0F, 1.0e-30F, 0.1F, 1.0F, 6.0e3F, 1.0e12F, 1.0e36F}) {
    ASSERT_GE(SpreadContexts::size_class(square), 0);
    ASSERT_LT(SpreadContexts::size_class(square), SpreadContexts::kSizes);
    for (const float bend_square : {0.0F, 0.01F, 25.0F, 1.0e12F}) {
      ASSERT_GE(SpreadContexts::normal(bend_square, square), SpreadContexts::kNormal);
      ASSERT_LT(SpreadContexts::normal(bend_square, square), SpreadContexts::kSpreads);
    }
  }
}

TEST(SplitModel, SizesAreClassedByHalfOctaves) {
  EXPECT_EQ(SpreadContexts::size_class(2.0F * 2.0F), SpreadContexts::size_class(1.0F) + 2);
  for (int c = 0; c < SpreadContexts::kSizes; ++c) {
    const float square = std::exp2(static_cast<float>(c - 4));  // the size is 2^(c / 2 - 2)
    EXPECT_EQ(SpreadContexts::size_class(square), c);
    EXPECT_EQ(SpreadContexts::size_class(1.99F * square), c);
  }
}

// A bend below a sixteenth of the ring's size, below a fifth, or more.
TEST(SplitModel, BendsAreClassedByTheRingsSizeToo) {
  for (const float mean : {1.0F, 9.0F, 300.0F}) {
    const auto ratio = [&](float of_mean) {
      const float bend_square = of_mean * of_mean * mean * mean;
      return (SpreadContexts::normal(bend_square, mean * mean) - SpreadContexts::kNormal -
              SpreadContexts::size_class(bend_square)) /
             SpreadContexts::kSizes;
    };
    EXPECT_EQ(ratio(0.06F), 0);
    EXPECT_EQ(ratio(0.065F), 1);
    EXPECT_EQ(ratio(0.19F), 1);
    EXPECT_EQ(ratio(0.21F), 2);
  }
}

}  // namespace
}  // namespace fanstream
