// Range coding with asymmetric numeral systems (Duda 2013): static frequencies, one 32-bit state, 16-bit words.
//
// A symbol coder is anything with `int symbol(const FrequencyTable&, int)` and `unsigned bits(int count, unsigned)`: the
// encoder records what it is given and returns it, the decoder ignores the argument and returns what it reads. Coding
// routines are written once, as templates over the coder, so that both sides cannot drift apart.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/coding/frequency_table.h"

namespace fanstream {

// Collects the symbols of one segment; finish() writes them. Not thread safe.
class RansEncoder {
 public:
  static constexpr bool kDecodes = false;
  int symbol(const FrequencyTable& table, int value) {
    steps_.push_back({table.start(value), table.frequency(value)});
    return value;
  }
  // `count` raw bits, 0..15.
  unsigned bits(int count, unsigned value) {
    if (count != 0) {
      steps_.push_back({static_cast<std::uint16_t>(value << (FrequencyTable::kBits - count)),
                        static_cast<std::uint16_t>(1U << (FrequencyTable::kBits - count))});
    }
    return value;
  }
  // The segment's bytes; the encoder is empty again afterwards. An empty segment has no bytes.
  std::vector<std::byte> finish();

 private:
  struct Step {
    std::uint16_t start;
    std::uint16_t frequency;
  };
  std::vector<Step> steps_;
};

// Reads what RansEncoder wrote. Safe on any bytes: past the end it reads zeros and remembers that it did.
class RansDecoder {
 public:
  static constexpr bool kDecodes = true;  // what is passed in as values does not matter and need not be computed
  RansDecoder() = default;
  explicit RansDecoder(std::span<const std::byte> bytes);

  int symbol(const FrequencyTable& table, int /*value*/) {
    const std::uint32_t slot = state_ & (FrequencyTable::kTotal - 1);
    const int found = table.find(slot);
    consume(slot, table.start(found), table.frequency(found));
    return found;
  }
  unsigned bits(int count, unsigned /*value*/) {
    if (count == 0) return 0;
    const std::uint32_t slot = state_ & (FrequencyTable::kTotal - 1);
    const int shift = FrequencyTable::kBits - count;
    const std::uint32_t value = slot >> shift;
    consume(slot, value << shift, 1U << shift);
    return value;
  }
  // True if all bytes were used, none was missing, and the state is the one that encoding starts from. Damaged
  // symbols hardly ever pass; damage to raw bits alone can (CODING.md), which is what checksums are for.
  bool finished_cleanly() const { return !overran_ && next_ == bytes_.size() && state_ == kStart; }
  bool overran() const { return overran_; }

  static constexpr std::uint32_t kStart = 1U << 16;

 private:
  void consume(std::uint32_t slot, std::uint32_t start, std::uint32_t frequency) {
    state_ = frequency * (state_ >> FrequencyTable::kBits) + slot - start;
    if (state_ < kStart) refill();
  }
  void refill() {
    std::uint32_t word = 0;
    if (next_ + 2 <= bytes_.size()) {
      word = std::to_integer<std::uint32_t>(bytes_[next_]) | std::to_integer<std::uint32_t>(bytes_[next_ + 1]) << 8U;
      next_ += 2;
    } else {
      overran_ = true;
    }
    state_ = state_ << 16U | word;
  }

  std::span<const std::byte> bytes_;
  std::size_t next_ = 0;
  std::uint32_t state_ = kStart;
  bool overran_ = false;
};

}  // namespace fanstream
