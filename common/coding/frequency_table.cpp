#include "common/coding/frequency_table.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace fanstream {

FrequencyTable::FrequencyTable(int symbols) {
  std::array<double, kMaxSymbols> weights{};
  weights.fill(1.0);
  *this = from_weights(std::span<const double>(weights).first(static_cast<std::size_t>(symbols)));
}

FrequencyTable FrequencyTable::from_weights(std::span<const double> weights) {
  assert(!weights.empty() && weights.size() <= kMaxSymbols);
  double sum = 0.0;
  for (const double w : weights) sum += w;
  std::array<std::uint32_t, kMaxSymbols> frequencies{};
  const auto count = weights.size();
  const auto spare = static_cast<double>(kTotal - 2 * count);
  std::uint32_t total = 0;
  std::size_t largest = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double share = sum > 0.0 ? weights[i] / sum : 1.0 / static_cast<double>(count);
    frequencies[i] = 2 + static_cast<std::uint32_t>(share * spare);
    total += frequencies[i];
    if (frequencies[i] > frequencies[largest]) largest = i;
  }
  frequencies[largest] += kTotal - total;
  FrequencyTable table;
  table.set_starts(std::span<const std::uint32_t>(frequencies).first(count));
  return table;
}

void FrequencyTable::set_starts(std::span<const std::uint32_t> frequencies) {
  symbols_ = static_cast<int>(frequencies.size());
  start_.fill(static_cast<std::uint16_t>(kTotal));
  std::uint32_t start = 0;
  for (std::size_t i = 0; i < frequencies.size(); ++i) {
    start_[i] = static_cast<std::uint16_t>(start);
    start += frequencies[i];
  }
  std::uint32_t symbol = 0;
  for (std::uint32_t block = 0; block < kBlocks; ++block) {
    const std::uint32_t slot = block << kBlockBits;
    while (start_[symbol + 1] <= slot) ++symbol;
    first_symbol_[block] = static_cast<std::uint8_t>(symbol);
    first_range_[block] = std::uint32_t{start_[symbol]} | frequencies[symbol] << 16U;
  }
}

double FrequencyTable::cost_bits(int symbol) const { return kBits - std::log2(static_cast<double>(frequency(symbol))); }

}  // namespace fanstream
