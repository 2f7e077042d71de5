#include "common/coding/split_model.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <type_traits>

#include "common/coding/residual_tables.h"

namespace fanstream {
namespace {

#include "common/coding/default_statistics.inc"

static_assert(std::size(kDefaultSymbols) == SymbolContexts::kTables);
static_assert(std::size(kDefaultTables) == CodingPhase::kPhases);
static_assert(std::size(kDefaultTables[0]) == SymbolContexts::kContexts);

constexpr double kQuarterOctave = 0.84089641525371454303;
constexpr std::uint8_t kFirstFreeShare = 4;
constexpr float kShareVariance = 9.0F;

// What the contexts of a table have in common.
struct TableKind {
  int symbols = 0;
  bool parents = false;
};

const std::array<TableKind, SymbolContexts::kTables>& table_kinds() {
  static const std::array<TableKind, SymbolContexts::kTables> kinds = [] {
    std::array<TableKind, SymbolContexts::kTables> found;
    for (const auto& tables : kDefaultTables) {
      for (int c = 0; c < SymbolContexts::kContexts; ++c) {
        found[tables[c]] = {SymbolContexts::symbol_count(c), c >= SymbolContexts::kParentFirst};
      }
    }
    return found;
  }();
  return kinds;
}

}  // namespace

int SymbolContexts::symbol_count(int context, bool free_parents) {
  if (context < kOpeningFirst) {
    const int by_free = context / (4 * kValences) + 1;  // those of FM0 come last
    return by_free < static_cast<int>(kManyFree) ? by_free + 1 : 32;
  }
  if (context < kLengthFirst) return 4;
  return context < kParentFirst ? 32 : free_parents ? 4 : 3;
}

int SymbolContexts::table_of(int phase, int context) { return kDefaultTables[phase][context]; }

int SymbolContexts::table_symbol_count(int table, bool free_parents) {
  const TableKind& kind = table_kinds()[static_cast<std::size_t>(table)];
  return kind.symbols + (kind.parents && free_parents ? 1 : 0);
}

bool SymbolContexts::is_of_parents(int table) { return table_kinds()[static_cast<std::size_t>(table)].parents; }

std::uint8_t coded_share(double count, double sum) {
  if (!(count > 0.0)) return SplitStatistics::kLeastShare;
  const long share = std::lround(-4.0 * std::log2(count / sum));
  return static_cast<std::uint8_t>(std::clamp(share, 0L, long{SplitStatistics::kLeastShare}));
}

FrequencyTable table_of(std::span<const std::uint8_t> coded_shares) {
  std::array<double, FrequencyTable::kMaxSymbols> weights{};
  static const std::array<double, SplitStatistics::kLeastShare + 1> kWeights = [] {
    std::array<double, SplitStatistics::kLeastShare + 1> powers{1.0};
    for (std::size_t q = 1; q < powers.size(); ++q) powers[q] = powers[q - 1] * kQuarterOctave;
    return powers;
  }();
  for (std::size_t i = 0; i < coded_shares.size(); ++i) weights[i] = kWeights[coded_shares[i] & 63U];
  return FrequencyTable::from_weights(std::span<const double>(weights).first(coded_shares.size()));
}

const SplitStatistics& SplitStatistics::built_in() {
  static const SplitStatistics statistics = [] {
    SplitStatistics s;
    for (std::size_t t = 0; t < s.symbols.size(); ++t) std::copy_n(kDefaultSymbols[t], 32, s.symbols[t].begin());
    for (std::size_t c = 0; c < s.weights.size(); ++c) {
      std::copy_n(kDefaultWeights[c], PredictionContexts::kFeatures, s.weights[c].begin());
    }
    std::copy_n(kDefaultScales, s.scales.size(), s.scales.begin());
    std::copy_n(kDefaultSpreads, SpreadContexts::kSpreads, s.spreads.begin());
    return s;
  }();
  return statistics;
}

void SplitStatistics::allow_free_parents() {
  has_free_parents = true;
  for (int t = 0; t < SymbolContexts::kTables; ++t) {
    if (SymbolContexts::is_of_parents(t)) symbols[static_cast<std::size_t>(t)][3] = kFirstFreeShare;
  }
  free_parent = {{}, {-16, -32, 0}};
}

namespace {

const FrequencyTable& differs_table() {
  static const FrequencyTable table = FrequencyTable::from_weights(std::array<double, 2>{7.0, 1.0});
  return table;
}

// Codes one group of numbers: whether it differs from the built-in one, and by how much. A decoder's is the built-in
// one before. Written once for both directions.
template <class Coder, class Number>
bool code_group(Coder& coder, std::span<Number> group, std::type_identity_t<std::span<const Number>> built_in, int low,
                int high) {
  int differs = 0;
  if constexpr (!Coder::kDecodes) differs = std::equal(group.begin(), group.end(), built_in.begin()) ? 0 : 1;
  differs = coder.symbol(differs_table(), differs);
  if (differs == 0) return true;
  for (std::size_t i = 0; i < group.size(); ++i) {
    const int value = ResidualTables::instance().code(coder, static_cast<float>(built_in[i]), 4.0F, group[i]);
    if (value < low || value > high) return false;
    group[i] = static_cast<Number>(value);
  }
  return true;
}

// The shares of one table: whether they differ, how many of them at least one, and by how much; the rest are as built
// in. A decoder's all are, before.
template <class Coder>
bool code_shares(Coder& coder, std::span<std::uint8_t> shares, std::span<const std::uint8_t> built_in) {
  std::size_t told = 0;
  if constexpr (!Coder::kDecodes) {
    told = shares.size();
    while (told > 0 && shares[told - 1] == built_in[told - 1]) --told;
  }
  if (coder.symbol(differs_table(), told > 0 ? 1 : 0) == 0) return true;
  told = coder.bits(5, static_cast<unsigned>(told - 1)) + std::size_t{1};
  if (told > shares.size()) return false;
  for (std::size_t i = 0; i < told; ++i) {
    const int value =
        ResidualTables::instance().code(coder, static_cast<float>(built_in[i]), kShareVariance, shares[i]);
    if (value < 0 || value > SplitStatistics::kLeastShare) return false;
    shares[i] = static_cast<std::uint8_t>(value);
  }
  return true;
}

template <class Coder>
bool code_statistics(Coder& coder, SplitStatistics& s) {
  const SplitStatistics& b = SplitStatistics::built_in();
  for (std::size_t t = 0; t < s.symbols.size(); ++t) {
    const auto count = static_cast<std::size_t>(SymbolContexts::table_symbol_count(static_cast<int>(t)));
    const std::span<std::uint8_t> group(s.symbols[t]);
    if (!code_shares(coder, group.first(count), std::span(b.symbols[t]).first(count))) return false;
  }
  for (std::size_t c = 0; c < s.weights.size(); ++c) {
    const std::span<std::int8_t> group(s.weights[c]);
    if (!code_group(coder, group, std::span<const std::int8_t>(b.weights[c]), -128, 127)) return false;
  }
  const auto code_each = [&](std::span<std::int8_t> numbers, std::span<const std::int8_t> built_in) {
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      if (!code_group(coder, numbers.subspan(i, 1), built_in.subspan(i, 1), -64, 127)) return false;
    }
    return true;
  };
  return code_each(s.scales, b.scales) && code_each(s.spreads, b.spreads);
}

// A coder that only adds up what its symbols would take.
struct BitCount {
  static constexpr bool kDecodes = false;
  double sum = 0.0;
  int symbol(const FrequencyTable& table, int value) {
    sum += table.cost_bits(value);
    return value;
  }
  unsigned bits(int count, unsigned value) {
    sum += count;
    return value;
  }
};

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
  for (std::size_t t = 0; t < s.symbols.size(); ++t) {
    if (!SymbolContexts::is_of_parents(static_cast<int>(t))) continue;
    valid = code(s.symbols[t][3], kFirstFreeShare, 0, SplitStatistics::kLeastShare) && valid;
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

double SplitStatistics::table_bits(std::span<const std::uint8_t> shares, std::span<const std::uint8_t> built_in) {
  std::array<std::uint8_t, FrequencyTable::kMaxSymbols> copy{};
  std::copy(shares.begin(), shares.end(), copy.begin());
  BitCount count;
  code_shares(count, std::span(copy).first(shares.size()), built_in);
  return count.sum;
}

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
      static_cast<std::size_t>(SymbolContexts::table_symbol_count(static_cast<int>(t), statistics.has_free_parents));
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
  std::array<const FrequencyTable*, SymbolContexts::kTables> tables{};
  for (std::size_t t = 0; t < tables.size(); ++t) {
    const bool more_symbols = statistics.has_free_parents && SymbolContexts::is_of_parents(static_cast<int>(t));
    if (!more_symbols && statistics.symbols[t] == built_in.symbols[t]) {
      tables[t] = &built_in_tables()[t];
    } else {
      own_.push_back(t);
    }
  }
  own_tables_.reserve(own_.size());
  for (const std::size_t t : own_) tables[t] = &own_tables_.emplace_back(symbol_table(statistics, t));
  for (int p = 0; p < CodingPhase::kPhases; ++p) {
    auto& of_phase = phases_[static_cast<std::size_t>(p)].tables;
    for (std::size_t c = 0; c < of_phase.size(); ++c) {
      of_phase[c] = tables[static_cast<std::size_t>(SymbolContexts::table_of(p, static_cast<int>(c)))];
    }
  }
  use(statistics);
}

SplitModel SplitModel::untied() { return SplitModel(Untied{}); }

SplitModel::SplitModel(Untied)
    : table_count_(std::size_t{CodingPhase::kPhases} * SymbolContexts::kContexts), own_tables_(table_count_) {
  for (std::size_t i = 0; i < table_count_; ++i) {
    const auto phase = static_cast<int>(i) / SymbolContexts::kContexts;
    const auto context = static_cast<int>(i) % SymbolContexts::kContexts;
    own_tables_[i] = built_in_tables()[static_cast<std::size_t>(SymbolContexts::table_of(phase, context))];
    phases_[static_cast<std::size_t>(phase)].tables[static_cast<std::size_t>(context)] = &own_tables_[i];
    own_.push_back(i);
  }
  use(SplitStatistics::built_in());
}

// All but the tables.
void SplitModel::use(const SplitStatistics& statistics) {
  const auto squared = [](int eighths) {
    const float spread = power_of_eighths(eighths);
    return spread * spread;
  };
  for (std::size_t p = 0; p < phases_.size(); ++p) {
    PhaseModel& phase = phases_[p];
    for (std::size_t c = 0; c < phase.weights.size(); ++c) {
      const std::size_t number = SplitStatistics::class_of(static_cast<int>(p), static_cast<int>(c));
      for (std::size_t f = 0; f < phase.weights[c].size(); ++f) {
        phase.weights[c][f] = static_cast<float>(statistics.weights[number][f]) / 64.0F;
      }
      phase.scales[c] = squared(statistics.scales[number]);
    }
    for (std::size_t i = 0; i < phase.variances.size(); ++i) phase.variances[i] = squared(statistics.spreads[i]);
    phase.has_free_parents = statistics.has_free_parents;
    for (std::size_t f = 0; f < phase.shift_weights.size(); ++f) {
      phase.shift_weights[f] = static_cast<float>(statistics.free_parent.weights[f]) / 64.0F;
    }
    for (std::size_t i = 0; i < phase.shift_variances.size(); ++i) {
      phase.shift_variances[i] = squared(statistics.free_parent.spreads[i]);
    }
  }
}

std::size_t SplitModel::index_of(const FrequencyTable& table) const {
  const auto place_in = [&table](const FrequencyTable* tables) {
    return (reinterpret_cast<std::uintptr_t>(&table) - reinterpret_cast<std::uintptr_t>(tables)) / sizeof(table);
  };
  const bool tied = table_count_ == SymbolContexts::kTables;
  const std::size_t built_in = place_in(built_in_tables().data());
  if (tied && built_in < SymbolContexts::kTables) return built_in;
  const std::size_t own = place_in(own_tables_.data());
  return own < own_.size() ? own_[own] : table_count_;
}

}  // namespace fanstream
