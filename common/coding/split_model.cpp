#include "common/coding/split_model.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <type_traits>

#include "common/coding/residual_tables.h"

namespace fanstream {
namespace {

#include "common/coding/default_statistics.inc"

constexpr double kHalfOctave = 0.70710678118654752440;
constexpr std::uint8_t kFirstFreeShare = 2;

}  // namespace

int SymbolContexts::symbol_count(int table, bool free_parents) {
  if (table < kOpeningFirst) {
    const int by_free = table / (4 * kValences) + 1;  // those of FM0 come last
    return by_free < static_cast<int>(kManyFree) ? by_free + 1 : 32;
  }
  if (table < kLengthFirst) return 4;
  return table < kParentFirst ? 32 : free_parents ? 4 : 3;
}

std::uint8_t coded_share(double count, double sum) {
  if (!(count > 0.0)) return 31;
  return static_cast<std::uint8_t>(std::clamp(std::lround(-2.0 * std::log2(count / sum)), 0L, 31L));
}

FrequencyTable table_of(std::span<const std::uint8_t> coded_shares) {
  std::array<double, FrequencyTable::kMaxSymbols> weights{};
  static const std::array<double, 32> kWeights = [] {
    std::array<double, 32> powers{1.0};
    for (std::size_t q = 1; q < powers.size(); ++q) powers[q] = powers[q - 1] * kHalfOctave;
    return powers;
  }();
  for (std::size_t i = 0; i < coded_shares.size(); ++i) weights[i] = kWeights[coded_shares[i] & 31U];
  return FrequencyTable::from_weights(std::span<const double>(weights).first(coded_shares.size()));
}

const SplitStatistics& SplitStatistics::built_in() {
  static const SplitStatistics statistics = [] {
    SplitStatistics s;
    for (std::size_t t = 0; t < s.symbols.size(); ++t) std::copy_n(kDefaultSymbols[t], 32, s.symbols[t].begin());
    for (std::size_t c = 0; c < s.weights.size(); ++c) {
      std::copy_n(kDefaultWeights[c], PredictionContexts::kFeatures, s.weights[c].begin());
    }
    std::copy_n(kDefaultSpreads, SpreadContexts::kSpreads, s.spreads.begin());
    return s;
  }();
  return statistics;
}

void SplitStatistics::allow_free_parents() {
  has_free_parents = true;
  for (std::size_t t = SymbolContexts::kParentFirst; t < symbols.size(); ++t) symbols[t][3] = kFirstFreeShare;
  free_parent = {{}, {-16, -32, 0}};
}

namespace {

// Codes one group of numbers: whether it differs from the built-in one, and by how much. A decoder's is the built-in
// one before. Written once for both directions.
template <class Coder, class Number>
bool code_group(Coder& coder, const FrequencyTable& differs_table, std::span<Number> group,
                std::type_identity_t<std::span<const Number>> built_in, int low, int high) {
  int differs = 0;
  if constexpr (!Coder::kDecodes) differs = std::equal(group.begin(), group.end(), built_in.begin()) ? 0 : 1;
  differs = coder.symbol(differs_table, differs);
  if (differs == 0) return true;
  for (std::size_t i = 0; i < group.size(); ++i) {
    const int value = ResidualTables::instance().code(coder, static_cast<float>(built_in[i]), 4.0F, group[i]);
    if (value < low || value > high) return false;
    group[i] = static_cast<Number>(value);
  }
  return true;
}

template <class Coder>
bool code_statistics(Coder& coder, SplitStatistics& s) {
  const SplitStatistics& b = SplitStatistics::built_in();
  const std::array<double, 2> rarely{7.0, 1.0};
  const FrequencyTable differs = FrequencyTable::from_weights(rarely);
  for (std::size_t t = 0; t < s.symbols.size(); ++t) {
    const auto count = static_cast<std::size_t>(SymbolContexts::symbol_count(static_cast<int>(t)));
    const std::span<std::uint8_t> group(s.symbols[t]);
    if (!code_group(coder, differs, group.first(count), std::span(b.symbols[t]).first(count), 0, 31)) return false;
  }
  for (std::size_t c = 0; c < s.weights.size(); ++c) {
    const std::span<std::int8_t> group(s.weights[c]);
    if (!code_group(coder, differs, group, std::span<const std::int8_t>(b.weights[c]), -128, 127)) return false;
  }
  for (std::size_t i = 0; i < s.spreads.size(); ++i) {
    const std::span<std::int8_t> group(&s.spreads[i], 1);
    if (!code_group(coder, differs, group, std::span<const std::int8_t>(&b.spreads[i], 1), -64, 127)) return false;
  }
  return true;
}

// Follows where there are free parents. The bit tells a decoder so: without, the state runs down to 0 before it.
template <class Coder>
bool code_free_parents(Coder& coder, SplitStatistics& s) {
  SplitStatistics first;
  first.allow_free_parents();
  if (coder.bits(1, 1) != 1) return false;
  const auto code = [&](auto& number, int expected, int low, int high) {
    const int value = ResidualTables::instance().code(coder, static_cast<float>(expected), 64.0F, number);
    number = static_cast<std::remove_reference_t<decltype(number)>>(std::clamp(value, low, high));
    return value >= low && value <= high;
  };
  bool valid = true;
  for (std::size_t t = SymbolContexts::kParentFirst; t < s.symbols.size(); ++t) {
    valid = code(s.symbols[t][3], kFirstFreeShare, 0, 31) && valid;
  }
  for (std::size_t f = 0; f < s.free_parent.weights.size(); ++f) {
    valid = code(s.free_parent.weights[f], first.free_parent.weights[f], -128, 127) && valid;
  }
  for (std::size_t i = 0; i < s.free_parent.spreads.size(); ++i) {
    valid = code(s.free_parent.spreads[i], first.free_parent.spreads[i], -64, 127) && valid;
  }
  return valid;
}

}  // namespace

void SplitStatistics::write(ByteWriter& out) const {
  RansEncoder encoder;
  SplitStatistics copy = *this;
  code_statistics(encoder, copy);
  if (has_free_parents) code_free_parents(encoder, copy);
  const std::vector<std::byte> bytes = encoder.finish();
  out.varint(bytes.size());
  out.bytes(bytes);
}

Result<SplitStatistics> SplitStatistics::read(ByteReader& in) {
  const std::uint64_t size = in.varint();
  RansDecoder decoder(in.bytes(static_cast<std::size_t>(std::min<std::uint64_t>(size, in.remaining() + 1))));
  SplitStatistics statistics = built_in();
  bool valid = !in.failed() && code_statistics(decoder, statistics);
  if (valid && !decoder.finished_cleanly()) {
    statistics.has_free_parents = true;
    valid = code_free_parents(decoder, statistics) && decoder.finished_cleanly();
  }
  if (!valid) return tl::unexpected(in.error("coding statistics", "damaged"));
  return statistics;
}

namespace {

// 2^(eighths/8), exactly the same everywhere.
float power_of_eighths(int eighths) {
  static constexpr std::array<float, 8> kSteps = {1.0F,        1.09050773F, 1.18920712F, 1.29683955F,
                                                  1.41421356F, 1.54221083F, 1.68179283F, 1.83400809F};
  return std::ldexp(kSteps[static_cast<std::size_t>(eighths & 7)], eighths >> 3);
}

using SymbolTables = std::array<FrequencyTable, SymbolContexts::kTables>;

FrequencyTable symbol_table(const SplitStatistics& statistics, std::size_t t) {
  const auto count =
      static_cast<std::size_t>(SymbolContexts::symbol_count(static_cast<int>(t), statistics.has_free_parents));
  return table_of(std::span(statistics.symbols[t]).first(count));
}

// Most models keep most of them, and a small one takes less time to decode than its tables would to make.
const SymbolTables& built_in_tables() {
  static const SymbolTables tables = [] {
    SymbolTables made;
    for (std::size_t t = 0; t < made.size(); ++t) made[t] = symbol_table(SplitStatistics::built_in(), t);
    return made;
  }();
  return tables;
}

}  // namespace

SplitModel::SplitModel(const SplitStatistics& statistics) {
  const SplitStatistics& built_in = SplitStatistics::built_in();
  const auto as_built_in = [&](std::size_t t) {
    const bool of_parents = t >= static_cast<std::size_t>(SymbolContexts::kParentFirst);
    return !(of_parents && statistics.has_free_parents) && statistics.symbols[t] == built_in.symbols[t];
  };
  for (std::size_t t = 0; t < tables_.size(); ++t) {
    if (as_built_in(t)) {
      tables_[t] = &built_in_tables()[t];
    } else {
      own_.push_back(t);
    }
  }
  own_tables_.reserve(own_.size());
  for (const std::size_t t : own_) tables_[t] = &own_tables_.emplace_back(symbol_table(statistics, t));
  for (std::size_t c = 0; c < weights.size(); ++c) {
    for (std::size_t f = 0; f < weights[c].size(); ++f)
      weights[c][f] = static_cast<float>(statistics.weights[c][f]) / 64.0F;
  }
  for (std::size_t i = 0; i < variances.size(); ++i) {
    const float spread = power_of_eighths(statistics.spreads[i]);
    variances[i] = spread * spread;
  }
  scales[1] = variances[SpreadContexts::kMiddleShift];
  has_free_parents = statistics.has_free_parents;
  for (std::size_t f = 0; f < shift_weights.size(); ++f) {
    shift_weights[f] = static_cast<float>(statistics.free_parent.weights[f]) / 64.0F;
  }
  for (std::size_t i = 0; i < shift_variances.size(); ++i) {
    const float spread = power_of_eighths(statistics.free_parent.spreads[i]);
    shift_variances[i] = spread * spread;
  }
}

std::size_t SplitModel::index_of(const FrequencyTable& table) const {
  const auto place_in = [&table](const FrequencyTable* tables) {
    return (reinterpret_cast<std::uintptr_t>(&table) - reinterpret_cast<std::uintptr_t>(tables)) / sizeof(table);
  };
  const std::size_t built_in = place_in(built_in_tables().data());
  if (built_in < SymbolContexts::kTables) return built_in;
  const std::size_t own = place_in(own_tables_.data());
  return own < own_.size() ? own_[own] : static_cast<std::size_t>(SymbolContexts::kTables);
}

}  // namespace fanstream
