// Symbol tables for prediction errors of a given expected size.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "common/coding/rans.h"

namespace fanstream {

// How a prediction's residual is coded.
struct ResidualChoice {
  std::int32_t zero = 0;    // the value of the first symbol and no low bits; it and those that follow need no escape
  std::int32_t mirror = 0;  // -1 where values fall from there on, 0 where they rise
  std::uint32_t table = 0;
  std::int32_t raw_bits = 0;

  // How far a value lies from the first one, and back. By masks, since a branch would be a coin toss.
  std::int32_t distance_of(std::int32_t value) const { return mirrored(value - zero); }
  std::int32_t value_at(std::int32_t distance) const { return zero + mirrored(distance); }

 private:
  std::int32_t mirrored(std::int32_t x) const { return (x ^ mirror) - mirror; }
};

// An error is cut into a symbol of 31 and raw low bits; rarer ones escape. Logistic distributions in steps of a
// quarter octave; below four grid steps also by where between two integers the prediction fell.
// Immutable and thread safe to read; one shared instance, since it depends on nothing.
class ResidualTables {
 public:
  static constexpr int kSteps = 4;           // per octave
  static constexpr int kLowest = -2;         // log2 of the smallest spread
  static constexpr int kSmall = 4 * kSteps;  // spreads below 2^2: with two phases each
  static constexpr int kMostRawBits = 15;
  static constexpr int kChoices = kSmall + kMostRawBits * kSteps;
  static constexpr float kFarthest = 4194303.0F;           // of means
  static constexpr float kRounder = 12582912.0F;           // below 2^22 a sum with it has no bits for fractions
  static constexpr std::uint32_t kHalfOctave = 0x3504F3U;  // of the bits of a variance's mantissa

  static const ResidualTables& instance();

  // Codes the integer `value`, of which `mean` is expected with about `variance` (in code steps, not negative).
  template <class Coder>
  std::int32_t code(Coder& coder, float mean, float variance, std::int32_t value) const {
    return code(coder, choose(mean, variance), value);
  }
  // The same in two steps (RingKernels::choose chooses for several at once).
  static ResidualChoice choose(float mean, float variance);
  template <class Coder>
  std::int32_t code(Coder& coder, const ResidualChoice& choice, std::int32_t value) const {
    return choice.value_at(code_distance(coder, choice, Coder::kDecodes ? 0 : choice.distance_of(value)));
  }
  // The same in terms of choice.distance_of(value).
  template <class Coder>
  std::int32_t code_distance(Coder& coder, const ResidualChoice& choice, std::int32_t distance) const;

  static constexpr int kCentre = 15;  // the symbol in whose middle the expected value lies

 private:
  ResidualTables();
  static constexpr int kEscape = 31;
  template <class Coder>
  std::int64_t code_escaped(Coder& coder, std::int32_t high, int raw_bits, unsigned low) const;

  // Of small spreads [step][phase], phase 1 where what is expected lies between two integers rather than near one; then
  // by step within the octave, for 2^2, raw-shifted down.
  std::array<FrequencyTable, std::size_t{2} * kSmall + kSteps> tables_;
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

inline ResidualChoice ResidualTables::choose(float mean, float variance) {
  // Far-off predictions can only come from damaged data; the clamp keeps the arithmetic defined.
  const float above = mean > -kFarthest ? mean : -kFarthest;  // also where the mean is not a number
  const float bounded = above < kFarthest ? above : kFarthest;
  const float nearest = (bounded + kRounder) - kRounder;  // even if halfway
  const auto fraction = std::bit_cast<std::uint32_t>(bounded - nearest);
  // The variance's exponent and the half of an octave it lies in, straight from its bits.
  const auto bits = std::bit_cast<std::uint32_t>(variance);
  const int halves =
      2 * (static_cast<int>(bits >> 23U) - 127 - 2 * kLowest) + static_cast<int>((bits & 0x7FFFFFU) >= kHalfOctave);
  // Mirrored where the fraction is negative, so that the rest always lies above.
  const int step = halves < 0 ? 0 : halves < kChoices ? halves : kChoices - 1;
  const int phase = (fraction & 0x7FFFFFFFU) >= std::bit_cast<std::uint32_t>(0.25F) ? 1 : 0;
  const bool small = step < kSmall;
  const int raw_bits = small ? 0 : (step - kSmall) / kSteps + 1;
  const std::int32_t mirror = static_cast<std::int32_t>(fraction) >> 31;
  const std::int32_t to_centre = kCentre * (1 << raw_bits) + (small ? 0 : (1 << raw_bits) / 2 - 1);
  return {static_cast<std::int32_t>(nearest) - ((to_centre ^ mirror) - mirror), mirror,
          static_cast<std::uint32_t>(small ? 2 * step + phase : 2 * kSmall + step % kSteps), raw_bits};
}

template <class Coder>
[[gnu::always_inline]] inline std::int32_t ResidualTables::code_distance(Coder& coder, const ResidualChoice& choice,
                                                                         std::int32_t distance) const {
  const int raw_bits = choice.raw_bits;
  std::int32_t high = 0;
  unsigned low = 0;
  if constexpr (!Coder::kDecodes) {
    high = distance >> raw_bits;
    low = static_cast<unsigned>(distance - high * (1 << raw_bits));
  }
  const bool escapes = high < 0 || high >= kEscape;
  const int symbol = coder.symbol(tables_[choice.table], escapes ? kEscape : high);
  if (symbol != kEscape) [[likely]] {
    return symbol * (1 << raw_bits) + (raw_bits == 0 ? 0 : static_cast<std::int32_t>(coder.bits(raw_bits, low)));
  }
  const std::int64_t far_off =
      code_aside(coder, [&](auto& reader) { return code_escaped(reader, high - kCentre, raw_bits, low); });
  const std::int64_t from_zero = far_off + kCentre * (1 << raw_bits);
  const std::int64_t wide = choice.zero + (choice.mirror != 0 ? -from_zero : from_zero);
  constexpr std::int64_t kMost = std::int64_t{1} << 28;
  return choice.distance_of(static_cast<std::int32_t>(wide < -kMost ? -kMost : wide > kMost ? kMost : wide));
}

}  // namespace fanstream
