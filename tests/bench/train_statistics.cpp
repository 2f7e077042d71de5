#include "tests/bench/train_statistics.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "server/build/asset_builder.h"

namespace fanstream::bench {
namespace {

constexpr auto kContexts = static_cast<std::size_t>(SymbolContexts::kContexts);

// Contexts that differ in the ring's size or the valence only.
int family_of(int context) {
  if (context < SymbolContexts::kOpeningFirst) return context / SymbolContexts::kValences;
  if (context < SymbolContexts::kLengthFirst) return 1000;
  if (context < SymbolContexts::kRankFirst)
    return 1001 + (context - SymbolContexts::kLengthFirst) / SymbolContexts::kRingClasses;
  if (context < SymbolContexts::kParentFirst) return 2000 + (context - SymbolContexts::kRankFirst) / 8;
  return 3000 + context;
}

// With a little of what the context is like in other phases, and of its family: rare ones then are put where they
// belong.
std::vector<SymbolCounts> smoothed(const std::vector<SymbolCounts>& counts) {
  std::vector<SymbolCounts> of_context(kContexts);
  std::vector<SymbolCounts> of_family(4000 + kContexts);
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const auto family = static_cast<std::size_t>(family_of(static_cast<int>(i % kContexts)));
    for (std::size_t s = 0; s < counts[i].size(); ++s) {
      of_context[i % kContexts][s] += counts[i][s];
      of_family[family][s] += counts[i][s];
    }
  }
  const auto blended = [](const SymbolCounts& counted, const SymbolCounts& prior, double weight, std::size_t symbols) {
    double sum = 0.0;
    for (std::size_t s = 0; s < symbols; ++s) sum += prior[s];
    SymbolCounts result = counted;
    for (std::size_t s = 0; s < symbols; ++s) result[s] += weight * prior[s] / sum;
    return result;
  };
  std::vector<SymbolCounts> result;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const auto context = static_cast<int>(i % kContexts);
    const auto symbols = static_cast<std::size_t>(SymbolContexts::symbol_count(context));
    SymbolCounts family = of_family[static_cast<std::size_t>(family_of(context))];
    for (std::size_t s = 0; s < symbols; ++s) family[s] += 0.01;
    constexpr double kWeight = 5.0;
    const SymbolCounts prior = blended(of_context[i % kContexts], family, kWeight, symbols);
    result.push_back(blended(counts[i], prior, kWeight, symbols));
  }
  return result;
}

// Parents have a table of their own, since they may have a symbol more.
int kind_of(int context) {
  return SymbolContexts::symbol_count(context) + (context >= SymbolContexts::kParentFirst ? 100 : 0);
}

void learn_tables(const std::vector<SymbolCounts>& counts, TrainedStatistics& trained) {
  const std::vector<SymbolCounts> contexts = smoothed(counts);
  std::vector<int> kinds;
  for (std::size_t i = 0; i < contexts.size(); ++i) kinds.push_back(kind_of(static_cast<int>(i % kContexts)));
  const std::vector<std::uint32_t> tables = cluster_contexts(contexts, kinds, SymbolContexts::kTables);
  std::vector<SymbolCounts> sums(SymbolContexts::kTables);
  std::vector<std::size_t> symbols(SymbolContexts::kTables, 1);
  for (std::size_t i = 0; i < contexts.size(); ++i) {
    trained.tables[i / kContexts][i % kContexts] = static_cast<std::uint8_t>(tables[i]);
    symbols[tables[i]] = static_cast<std::size_t>(SymbolContexts::symbol_count(static_cast<int>(i % kContexts)));
    for (std::size_t s = 0; s < contexts[i].size(); ++s) sums[tables[i]][s] += contexts[i][s];
  }
  for (std::size_t t = 0; t < sums.size(); ++t) {
    double sum = 0.0;
    for (const double c : sums[t]) sum += c;
    auto& shares = trained.statistics.symbols[t];
    for (std::size_t s = 0; s < shares.size(); ++s) {
      shares[s] = s < symbols[t] ? coded_share(sums[t][s], sum) : SplitStatistics::kLeastShare;
    }
  }
}

}  // namespace

TrainedStatistics TrainedStatistics::built_in() {
  TrainedStatistics result{{}, SplitStatistics::built_in()};
  for (int p = 0; p < CodingPhase::kPhases; ++p) {
    for (int c = 0; c < SymbolContexts::kContexts; ++c) {
      result.tables[static_cast<std::size_t>(p)][static_cast<std::size_t>(c)] =
          static_cast<std::uint8_t>(SymbolContexts::table_of(p, c));
    }
  }
  return result;
}

StatisticsTraining::StatisticsTraining() : counts_(CodingPhase::kPhases * kContexts), geometry_(1) {}

Result<void> StatisticsTraining::add(const TriangleMesh& mesh, int position_bits) {
  BuildOptions options;
  options.position_bits = position_bits;
  Result<SplitSample> sample = sample_splits(mesh, options);
  if (!sample) return tl::unexpected(sample.error());
  constexpr double kSplitsOfAModel = 20'000.0;
  constexpr std::size_t kSamplesOfAModel = 8'000;
  const double weight = kSplitsOfAModel / static_cast<double>(mesh.positions.size());
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    for (std::size_t s = 0; s < counts_[i].size(); ++s) counts_[i][s] += weight * sample->counts[i][s];
  }
  geometry_.add(sample->geometry, kSamplesOfAModel);
  return {};
}

TrainedStatistics StatisticsTraining::learn() const {
  TrainedStatistics trained = TrainedStatistics::built_in();
  learn_tables(counts_, trained);
  geometry_.learn_built_in(trained.statistics);
  return trained;
}

std::string statistics_source(const TrainedStatistics& trained, const std::string& comment) {
  const SplitStatistics& statistics = trained.statistics;
  const auto in_lines = [](const auto& numbers) {
    std::string lines;
    constexpr std::size_t kPerLine = 24;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      lines += fmt::format("{}{},", i % kPerLine == 0 ? "\n    " : " ", numbers[i]);
    }
    return lines;
  };
  std::string out = fmt::format("// {}\nconstexpr std::uint8_t kDefaultTables[][{}] = {{", comment, kContexts);
  for (const auto& tables : trained.tables) out += fmt::format("{{{}\n}}, ", in_lines(tables));
  out += "};\nconstexpr std::uint8_t kDefaultSymbols[][32] = {\n";
  for (const auto& table : statistics.symbols) out += fmt::format("    {{{}}},\n", fmt::join(table, ", "));
  out += "};\nconstexpr std::int8_t kDefaultWeights[][4] = {\n";
  for (const auto& weights : statistics.weights) out += fmt::format("    {{{}}},\n", fmt::join(weights, ", "));
  out += fmt::format("}};\nconstexpr std::int8_t kDefaultScales[] = {{{}\n}};\n", in_lines(statistics.scales));
  return out + fmt::format("constexpr std::int8_t kDefaultSpreads[] = {{{}\n}};\n", in_lines(statistics.spreads));
}

}  // namespace fanstream::bench
