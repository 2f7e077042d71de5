// Symbol tables for prediction errors of a given expected size.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "common/coding/rans.h"

namespace fanstream {

// How a prediction's residual is coded.
struct ResidualChoice {
  std::int32_t base = 0;    // the integer nearest to what is expected
  std::int32_t mirror = 0;  // -1 where errors are coded with their signs changed, else 0
  std::uint32_t table = 0;
  std::int32_t raw_bits = 0;
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
  std::int32_t code(Coder& coder, const ResidualChoice& choice, std::int32_t value) const;

 private:
  ResidualTables();
  static constexpr int kCentre = 15;
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
  return {static_cast<std::int32_t>(nearest), static_cast<std::int32_t>(fraction) >> 31,
          static_cast<std::uint32_t>(small ? 2 * step + phase : 2 * kSmall + step % kSteps),
          small ? 0 : (step - kSmall) / kSteps + 1};
}

template <class Coder>
[[gnu::always_inline]] inline std::int32_t ResidualTables::code(Coder& coder, const ResidualChoice& choice,
                                                                std::int32_t value) const {
  // By masks, since a branch would be a coin toss.
  const auto mirrored = [mirror = choice.mirror](auto x) { return (x ^ mirror) - mirror; };
  const FrequencyTable& table = tables_[choice.table];
  const int raw_bits = choice.raw_bits;
  const std::int32_t half = (((1 << raw_bits) >> 1) - 1) & -static_cast<std::int32_t>(raw_bits != 0);
  std::int32_t high = 0;
  unsigned low = 0;
  if constexpr (!Coder::kDecodes) {
    const std::int32_t error = mirrored(value - choice.base) + half;
    high = error >> raw_bits;
    low = static_cast<unsigned>(error - (high << raw_bits));
  }
  const bool escapes = high < -kCentre || high > kCentre;
  const int symbol = coder.symbol(table, escapes ? kEscape : high + kCentre);
  if (symbol != kEscape) [[likely]] {
    const auto decoded_low = raw_bits == 0 ? 0 : static_cast<std::int32_t>(coder.bits(raw_bits, low));
    return choice.base + mirrored((symbol - kCentre) * (1 << raw_bits) + decoded_low - half);
  }
  const std::int64_t far_off =
      code_aside(coder, [&](auto& reader) { return code_escaped(reader, high, raw_bits, low); });
  const std::int64_t wide = choice.base + mirrored(far_off - half);
  constexpr std::int64_t kMost = std::int64_t{1} << 28;
  return static_cast<std::int32_t>(wide < -kMost ? -kMost : wide > kMost ? kMost : wide);
}

}  // namespace fanstream
