// Range coding with asymmetric numeral systems (Duda 2013): static frequencies, one 32-bit state, 16-bit words. The
// last symbols are coded in a state that has not filled up yet, so that a stream costs two bytes more than its symbols,
// not three.
//
// A symbol coder is anything with `int symbol(const FrequencyTable&, int)` and `unsigned bits(int count, unsigned)`:
// the encoder records what it is given and returns it, the decoder ignores the argument and returns what it reads.
// Coding routines are written once, as templates over the coder, so that both sides cannot drift apart.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/coding/frequency_table.h"

namespace fanstream {

// Collects the symbols of a stream that is cut into segments. Not thread safe.
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
  // What comes from here on belongs to the next segment. A decoder that has used up the segments before needs no more
  // to go on.
  void cut() { cuts_.push_back(steps_.size()); }
  // The stream's bytes by segment, one more than there were cuts; the encoder is empty again afterwards. A segment
  // without symbols has no bytes, nor need one of few symbols.
  std::vector<std::vector<std::byte>> finish_segments();
  // Of a stream without cuts.
  std::vector<std::byte> finish() { return std::move(finish_segments().front()); }

 private:
  struct Step {
    std::uint16_t start;
    std::uint16_t frequency;
  };
  std::vector<Step> steps_;
  std::vector<std::size_t> cuts_;
};

// Reads what RansEncoder wrote. Safe on any bytes: where words are missing it goes on with the state it has.
// The bytes must outlive it.
class RansDecoder {
 public:
  static constexpr bool kDecodes = true;  // what is passed in as values does not matter and need not be computed
  RansDecoder() = default;
  explicit RansDecoder(std::span<const std::byte> whole_stream) { append(whole_stream, true); }

  // Goes on with the next segment. `ends`: none that follows it has any bytes. Precondition: used_up().
  void append(std::span<const std::byte> bytes, bool ends);

  // Where it stands between two symbols, to go on from there later, in the same segment's bytes wherever they lie then.
  struct Mark {
    std::uint32_t state = 0;
    std::uint32_t position = 0;
    bool begun = false;
  };
  Mark mark() const { return {state_, static_cast<std::uint32_t>(position_), begun_}; }
  RansDecoder(const Mark& mark, std::span<const std::byte> bytes, bool ends)
      : bytes_(bytes.data()),
        position_(mark.position),
        size_(bytes.size()),
        state_(mark.state),
        ends_(ends),
        begun_(mark.begun) {}

  [[gnu::always_inline]] int symbol(const FrequencyTable& table, int /*value*/) {
    const std::uint32_t slot = state_ & (FrequencyTable::kTotal - 1);
    const int found = table.find(slot);
    consume(slot, table.start(found), table.frequency(found));
    return found;
  }
  [[gnu::always_inline]] unsigned bits(int count, unsigned /*value*/) {
    const std::uint32_t slot = state_ & (FrequencyTable::kTotal - 1);
    const int shift = FrequencyTable::kBits - count;
    const std::uint32_t value = slot >> shift;
    consume(slot, value << shift, 1U << shift);
    return value;
  }
  // True if all bytes were used and, as far as this can be told before the stream's end, none was missing.
  bool used_up() const { return position_ == size_ && !starved(); }
  // True if besides the stream is at its end. Damaged symbols hardly ever pass; damage to raw bits alone can, and so
  // can a stream that lacks its end (CODING.md): lengths and checksums are the format's business.
  bool finished_cleanly() const { return used_up() && ends_ && state_ == 0; }
  // Words were missing though the stream had not ended.
  bool starved() const { return begun_ && !ends_ && state_ < kLeast; }

  // A state is never below it while there are words left.
  static constexpr std::uint32_t kLeast = 1U << 16;

 private:
  static constexpr std::array<std::byte, 2> kNothing{};

  // Every seventh step or so takes a word, nobody can tell which: so none branches on it.
  [[gnu::always_inline]] void consume(std::uint32_t slot, std::uint32_t start, std::uint32_t frequency) {
    const std::uint32_t state = frequency * (state_ >> FrequencyTable::kBits) + slot - start;
    const bool any = position_ < size_;
    const std::byte* from = any ? bytes_ + position_ : kNothing.data();
    const std::uint32_t word = std::to_integer<std::uint32_t>(from[0]) | std::to_integer<std::uint32_t>(from[1]) << 8U;
    const bool takes = any & (state < kLeast);
    state_ = takes ? state << 16U | word : state;
    position_ += takes ? 2 : 0;
  }

  const std::byte* bytes_ = nullptr;
  std::size_t position_ = 0;
  std::size_t size_ = 0;  // even
  std::uint32_t state_ = 0;
  bool ends_ = true;
  bool begun_ = false;  // some segment had bytes
};

}  // namespace fanstream
