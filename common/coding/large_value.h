// Numbers without a small limit, as symbols.
#pragma once

#include <algorithm>
#include <cstdint>

#include "common/coding/frequency_table.h"

namespace fanstream {

// Values 0.. with an escape at the table's last symbol.
template <class Coder>
[[gnu::always_inline]] inline std::uint32_t code_large(Coder& coder, const FrequencyTable& table, std::uint32_t value) {
  const auto escape = static_cast<std::uint32_t>(table.symbol_count() - 1);
  const auto symbol = static_cast<std::uint32_t>(coder.symbol(table, static_cast<int>(std::min(value, escape))));
  if (symbol < escape) [[likely]]
    return symbol;
  const unsigned rest = value - escape;
  const unsigned high = coder.bits(12, rest >> 12U);
  return escape + (high << 12U) + coder.bits(12, rest & 0xFFFU);
}

}  // namespace fanstream
