// Numbers without a small limit, as symbols.
#pragma once

#include <algorithm>
#include <cstdint>

#include "common/coding/rans.h"

namespace fanstream {

template <class Coder>
[[gnu::noinline]] std::uint32_t code_rest(Coder& coder, std::uint32_t rest) {
  const unsigned high = coder.bits(12, rest >> 12U);
  return (high << 12U) + coder.bits(12, rest & 0xFFFU);
}

// Values 0.. with an escape at the last symbol of a table of kMaxSymbols.
template <class Coder>
[[gnu::always_inline]] inline std::uint32_t code_large(Coder& coder, const FrequencyTable& table, std::uint32_t value) {
  constexpr std::uint32_t kEscape = FrequencyTable::kMaxSymbols - 1;
  const auto symbol = static_cast<std::uint32_t>(coder.symbol(table, static_cast<int>(std::min(value, kEscape))));
  if (symbol < kEscape) [[likely]]
    return symbol;
  return kEscape + code_aside(coder, [&](auto& reader) { return code_rest(reader, value - kEscape); });
}

}  // namespace fanstream
