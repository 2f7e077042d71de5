#include "tests/bench/train_statistics.h"

#include <fmt/format.h>

#include "server/build/asset_builder.h"

namespace fanstream::bench {

StatisticsTraining::StatisticsTraining() : counts_(SymbolContexts::kTables), geometry_(1) {}

Result<void> StatisticsTraining::add(const TriangleMesh& mesh, int position_bits) {
  BuildOptions options;
  options.position_bits = position_bits;
  Result<SplitSample> sample = sample_splits(mesh, options);
  if (!sample) return tl::unexpected(sample.error());
  constexpr double kSplitsOfAModel = 20'000.0;
  const double weight = kSplitsOfAModel / static_cast<double>(mesh.positions.size());
  for (std::size_t t = 0; t < counts_.size(); ++t) {
    for (std::size_t s = 0; s < counts_[t].size(); ++s) counts_[t][s] += weight * sample->counts[t][s];
  }
  geometry_.add(sample->geometry);
  return {};
}

SplitStatistics StatisticsTraining::learn() const {
  SplitStatistics statistics = SplitStatistics::built_in();
  for (std::size_t t = 0; t < counts_.size(); ++t) {
    const auto symbols = static_cast<std::size_t>(SymbolContexts::symbol_count(static_cast<int>(t)));
    // A little of a falling distribution stands in for symbols that the corpus does not show.
    std::array<double, FrequencyTable::kMaxSymbols> blended{};
    double sum = 0.0;
    for (std::size_t s = 0; s < symbols; ++s) {
      blended[s] = counts_[t][s] + 0.5 / static_cast<double>(s + 1);
      sum += blended[s];
    }
    for (std::size_t s = 0; s < blended.size(); ++s) {
      constexpr std::uint8_t kNever = 31;
      statistics.symbols[t][s] = s < symbols ? coded_share(blended[s], sum) : kNever;
    }
  }
  geometry_.learn(statistics);
  return statistics;
}

std::string statistics_source(const SplitStatistics& statistics, const std::string& comment) {
  std::string out = "// " + comment + "\nconstexpr std::uint8_t kDefaultSymbols[][32] = {\n";
  for (const auto& table : statistics.symbols) out += fmt::format("    {{{}}},\n", fmt::join(table, ", "));
  out += "};\nconstexpr std::int8_t kDefaultWeights[][4] = {\n";
  for (const auto& weights : statistics.weights) out += fmt::format("    {{{}}},\n", fmt::join(weights, ", "));
  out += "};\nconstexpr std::int8_t kDefaultSpreads[] = {";
  for (std::size_t i = 0; i < statistics.spreads.size(); ++i) {
    constexpr std::size_t kPerLine = 20;
    out += fmt::format("{}{},", i % kPerLine == 0 ? "\n    " : " ", statistics.spreads[i]);
  }
  return out + "\n};\n";
}

}  // namespace fanstream::bench
