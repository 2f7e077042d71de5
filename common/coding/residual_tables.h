// Symbol tables for prediction errors of a given expected size.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "common/coding/rans.h"

namespace fanstream {

// An error is cut into a symbol of 31 and raw low bits; rarer ones escape. Logistic distributions in steps of a
// quarter octave; below four grid steps also by where between two integers the prediction fell.
// Immutable and thread safe to read; one shared instance, since it depends on nothing.
class ResidualTables {
 public:
  static const ResidualTables& instance();

  // Codes the integer `value`, of which `mean` is expected with about `variance` (in code steps, not negative).
  template <class Coder>
  std::int32_t code(Coder& coder, float mean, float variance, std::int32_t value) const;

 private:
  ResidualTables();
  static constexpr int kSteps = 4;           // per octave
  static constexpr int kLowest = -2;         // log2 of the smallest spread
  static constexpr int kSmall = 4 * kSteps;  // spreads below 2^2: with two phases each
  static constexpr int kMostRawBits = 15;
  static constexpr int kChoices = kSmall + kMostRawBits * kSteps;
  static constexpr int kCentre = 15;
  static constexpr int kEscape = 31;
  struct Choice {
    std::array<const FrequencyTable*, 2> tables{};  // predictions near an integer, and others
    int raw_bits = 0;
  };
  // The variance's exponent and the half of an octave it lies in, straight from its bits.
  const Choice& choose(float variance) const {
    const auto bits = std::bit_cast<std::uint32_t>(variance);
    const int halves =
        2 * (static_cast<int>(bits >> 23U) - 127 - 2 * kLowest) + static_cast<int>((bits & 0x7FFFFFU) >= 0x3504F3U);
    return choices_[static_cast<std::size_t>(halves < 0 ? 0 : halves < kChoices ? halves : kChoices - 1)];
  }
  template <class Coder>
  std::int64_t code_escaped(Coder& coder, std::int32_t high, int raw_bits, unsigned low) const;

  std::vector<FrequencyTable> small_;  // [spread][phase]
  std::vector<FrequencyTable> large_;  // [spread within the octave], for 2^2 raw-shifted down
  std::array<Choice, kChoices> choices_{};
};

// The distances from -kCentre..kCentre outwards, with an Elias gamma code, and the low bits.
template <class Coder>
[[gnu::noinline]] std::int64_t ResidualTables::code_escaped(Coder& coder, std::int32_t high, int raw_bits,
                                                            unsigned low) const {
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
  const std::int64_t decoded_high =
      negative != 0U ? -static_cast<std::int64_t>(magnitude) : static_cast<std::int64_t>(magnitude);
  return decoded_high * (std::int64_t{1} << raw_bits) + static_cast<std::int64_t>(coder.bits(raw_bits, low));
}

template <class Coder>
[[gnu::always_inline]] inline std::int32_t ResidualTables::code(Coder& coder, float mean, float variance,
                                                                std::int32_t value) const {
  // Far-off predictions can only come from damaged data; the clamp keeps the arithmetic defined.
  constexpr float kFar = 4194303.0F;
  const float above = mean > -kFar ? mean : -kFar;  // also where the mean is not a number
  const float bounded = above < kFar ? above : kFar;
  // The nearest integer, even if halfway: below 2^22 the sum has no bits for fractions.
  constexpr float kRounder = 12582912.0F;
  const float nearest = (bounded + kRounder) - kRounder;
  const auto base = static_cast<std::int32_t>(nearest);
  const auto fraction = std::bit_cast<std::uint32_t>(bounded - nearest);
  // Mirrored where the fraction is negative, so that the rest always lies above; by masks, since a branch would be a
  // coin toss.
  const auto mirror = static_cast<std::int32_t>(fraction) >> 31;
  const auto mirrored = [mirror](auto x) { return (x ^ mirror) - mirror; };
  const Choice& choice = choose(variance);
  const FrequencyTable& table = *choice.tables[(fraction & 0x7FFFFFFFU) >= std::bit_cast<std::uint32_t>(0.25F) ? 1 : 0];
  const std::int32_t half = (1 << choice.raw_bits) >> 1;
  std::int32_t high = 0;
  unsigned low = 0;
  if constexpr (!Coder::kDecodes) {
    const std::int32_t error = mirrored(value - base) + half;
    high = error >> choice.raw_bits;
    low = static_cast<unsigned>(error - (high << choice.raw_bits));
  }
  const bool escapes = high < -kCentre || high > kCentre;
  const int symbol = coder.symbol(table, escapes ? kEscape : high + kCentre);
  if (symbol != kEscape) [[likely]] {
    if (choice.raw_bits == 0) return base + mirrored(symbol - kCentre);
    const auto decoded_low = static_cast<std::int32_t>(coder.bits(choice.raw_bits, low));
    return base + mirrored((symbol - kCentre) * (1 << choice.raw_bits) + decoded_low - half);
  }
  const std::int64_t far_off = [&] {
    if constexpr (Coder::kDecodes) {  // on a copy, so that the decoder itself can stay in registers
      Coder aside = coder;
      const std::int64_t decoded = code_escaped(aside, high, choice.raw_bits, low);
      coder = aside;
      return decoded;
    } else {
      return code_escaped(coder, high, choice.raw_bits, low);
    }
  }();
  const std::int64_t wide = base + mirrored(far_off - half);
  constexpr std::int64_t kMost = std::int64_t{1} << 28;
  return static_cast<std::int32_t>(wide < -kMost ? -kMost : wide > kMost ? kMost : wide);
}

}  // namespace fanstream
