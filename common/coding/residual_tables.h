// Symbol tables for prediction errors of a given expected size.
#pragma once

#include <cstdint>
#include <vector>

#include "common/coding/rans.h"

namespace fanstream {

// An error is cut into a symbol of 31 and raw low bits; rarer ones escape. Logistic distributions in steps of a
// quarter octave; below two grid steps also by where between two integers the prediction fell.
// Immutable and thread safe to read; one shared instance, since it depends on nothing.
class ResidualTables {
 public:
  static const ResidualTables& instance();

  // Codes the integer `value`, of which `mean` +- about `spread` is expected (both in code steps, finite).
  template <class Coder>
  std::int32_t code(Coder& coder, float mean, float spread, std::int32_t value) const;

 private:
  ResidualTables();
  static constexpr int kSteps = 4;       // per octave
  static constexpr int kLowest = -2;     // log2 of the smallest spread
  static constexpr int kSmall = 4 * kSteps;  // spreads below 2^2: with two phases each
  static constexpr int kCentre = 15;
  static constexpr int kEscape = 31;
  struct Choice {
    const FrequencyTable* table;
    int raw_bits;
  };
  Choice choose(float spread, float fraction) const;

  std::vector<FrequencyTable> small_;  // [spread][phase]
  std::vector<FrequencyTable> large_;  // [spread within the octave], for 2^2 raw-shifted down
};

template <class Coder>
std::int32_t ResidualTables::code(Coder& coder, float mean, float spread, std::int32_t value) const {
  // Far-off predictions can only come from damaged data; the clamp keeps the arithmetic defined.
  constexpr float kFar = 16777216.0F;  // with it, every value within 2^24 of 0 is coded exactly
  const float bounded = mean > kFar ? kFar : mean < -kFar ? -kFar : mean == mean ? mean : 0.0F;
  auto base = static_cast<std::int32_t>(bounded);
  float fraction = bounded - static_cast<float>(base);
  if (fraction > 0.5F) {
    ++base;
    fraction -= 1.0F;
  } else if (fraction < -0.5F) {
    --base;
    fraction += 1.0F;
  }
  const bool mirrored = fraction < 0.0F;
  const Choice choice = choose(spread, mirrored ? -fraction : fraction);
  const std::int32_t half = (1 << choice.raw_bits) >> 1;
  std::int32_t high = 0;
  unsigned low = 0;
  if constexpr (!Coder::kDecodes) {
    const std::int32_t error = (mirrored ? base - value : value - base) + half;
    high = error >> choice.raw_bits;
    low = static_cast<unsigned>(error - (high << choice.raw_bits));
  }
  const bool escapes = high < -kCentre || high > kCentre;
  const int symbol = coder.symbol(*choice.table, escapes ? kEscape : high + kCentre);
  std::int32_t decoded_high = symbol - kCentre;
  if (symbol == kEscape) [[unlikely]] {
    const unsigned negative = coder.bits(1, high < 0 ? 1U : 0U);
    const unsigned excess = static_cast<unsigned>(high < 0 ? -high : high) - (kCentre + 1U);
    int length = 0;  // of excess + 1 in bits, less one
    while (length < 24 && ((excess + 1U) >> (length + 1)) != 0U) ++length;
    length = static_cast<int>(coder.bits(5, static_cast<unsigned>(length)));
    const unsigned rest = excess + 1U - (1U << length);
    const int upper_bits = length > 12 ? length - 12 : 0;
    const unsigned upper = coder.bits(upper_bits < 15 ? upper_bits : 15, rest >> 12U);
    const unsigned lower = coder.bits(length > 12 ? 12 : length, length > 12 ? rest & 0xFFFU : rest);
    const unsigned magnitude = (1U << (length < 25 ? length : 25)) - 1U + (upper << 12U) + lower + kCentre + 1U;
    decoded_high = negative != 0U ? -static_cast<std::int32_t>(magnitude) : static_cast<std::int32_t>(magnitude);
  }
  const auto decoded_low = static_cast<std::int32_t>(coder.bits(choice.raw_bits, low));
  const auto wide = (static_cast<std::int64_t>(decoded_high) << choice.raw_bits) + decoded_low - half;
  constexpr std::int64_t kMost = std::int64_t{1} << 28;
  const std::int64_t result = mirrored ? base - wide : base + wide;
  return static_cast<std::int32_t>(result < -kMost ? -kMost : result > kMost ? kMost : result);
}

}  // namespace fanstream
