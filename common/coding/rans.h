// Range coding with asymmetric numeral systems (Duda 2013): static frequencies, one 32-bit state, 16-bit words. The
// last symbols are coded in a state that has not filled up yet, so that a stream costs two bytes more than its symbols,
// not three.
//
// A symbol coder is anything with `int symbol(const FrequencyTable&, int)` and `unsigned bits(int count, unsigned)`:
// the encoder records what it is given and returns it, the decoder ignores the argument and returns what it reads.
// Coding routines are written once, as templates over the coder, so that both sides cannot drift apart.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "common/coding/frequency_table.h"

namespace fanstream {

// Collects the symbols of a stream that is cut into segments. Not thread safe.
class RansEncoder {
 public:
  static constexpr bool kDecodes = false;
  int symbol(const FrequencyTable& table, int value) {
    steps_.push_back({table.start(value), table.frequency(value), 0});
    return value;
  }
  // `count` raw bits, 0..15.
  unsigned bits(int count, unsigned value) {
    if (count != 0) steps_.push_back({static_cast<std::uint16_t>(value), 0, static_cast<std::uint16_t>(count)});
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
    std::uint16_t start;      // or the value of raw bits
    std::uint16_t frequency;  // of a symbol
    std::uint16_t raw_bits;   // or 0
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
      : bytes_(bytes.size() >= 2 ? bytes.data() : kNothing.data()),
        position_(mark.position),
        size_(bytes.size()),
        state_(mark.state),
        ends_(ends),
        begun_(mark.begun) {}

  int symbol(const FrequencyTable& table, int value);
  unsigned bits(int count, unsigned value);
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
  friend class FastRansDecoder;
  static constexpr std::array<std::byte, 2> kNothing{};

  const std::byte* bytes_ = kNothing.data();  // two can be read, whatever the size
  std::size_t position_ = 0;
  std::size_t size_ = 0;  // even
  std::uint32_t state_ = 0;
  bool ends_ = true;
  bool begun_ = false;  // some segment had bytes
};

// A RansDecoder at work on many symbols: what changes with each stays in registers until this goes. Until then the
// decoder is not to be used but by aside().
class FastRansDecoder {
 public:
  static constexpr bool kDecodes = true;
  // Inlined, as all of it, or the compiler keeps what changes in memory.
  [[gnu::always_inline]] explicit FastRansDecoder(RansDecoder& decoder) : decoder_(decoder) { fetch(); }
  [[gnu::always_inline]] ~FastRansDecoder() { put_back(); }
  FastRansDecoder(const FastRansDecoder&) = delete;
  FastRansDecoder& operator=(const FastRansDecoder&) = delete;

  [[gnu::always_inline]] int symbol(const FrequencyTable& table, int /*value*/) {
    const std::uint32_t slot = state_ & (FrequencyTable::kTotal - 1);
    const FrequencyTable::Found found = table.find(slot);
    state_ = found.frequency * (state_ >> FrequencyTable::kBits) + (slot - found.start);
    take_word();
    return found.symbol;
  }
  [[gnu::always_inline]] unsigned bits(int count, unsigned /*value*/) {
    const std::uint32_t value = state_ & ((1U << count) - 1U);
    state_ >>= count;
    take_word();
    return value;
  }
  // What is rare and long: `read` is given the decoder itself.
  template <class Read>
  [[gnu::always_inline]] auto aside(Read&& read) {
    put_back();
    const auto result = read(decoder_);
    fetch();
    return result;
  }

 private:
  [[gnu::always_inline]] void fetch() {
    state_ = decoder_.state_;
    at_ = decoder_.bytes_ + decoder_.position_;
    end_ = decoder_.bytes_ + decoder_.size_;
  }
  [[gnu::always_inline]] void put_back() {
    decoder_.state_ = state_;
    decoder_.position_ = static_cast<std::size_t>(at_ - decoder_.bytes_);
  }

  // Every seventh step or so takes a word, nobody can tell which: so none branches on it. Everything but the state is
  // there early, and the state has little left to go through.
  [[gnu::always_inline]] void take_word() {
    if (at_ >= end_) [[unlikely]]
      return;
    at_ += 2 * fill(state_, state_ << 16U | word_at(at_));
  }
  static std::uint32_t word_at(const std::byte* at) {
    if constexpr (std::endian::native == std::endian::little) {
      std::uint16_t word = 0;
      std::memcpy(&word, at, sizeof(word));
      return word;
    }
    return std::to_integer<std::uint32_t>(at[0]) | std::to_integer<std::uint32_t>(at[1]) << 8U;
  }
  // A state below the least becomes `filled`. Returns 1 then, else 0.
  [[gnu::always_inline]] static std::size_t fill(std::uint32_t& state, std::uint32_t filled) {
#if defined(__x86_64__) && defined(__GNUC__)
    // The compiler makes a branch of it, whatever it is told of the odds.
    std::size_t taken = 0;
    __asm__("cmpl %[least], %[state]\n\tcmovbl %[filled], %[state]\n\tadcq $0, %[taken]"
            : [state] "+r"(state), [taken] "+r"(taken)
            : [least] "i"(RansDecoder::kLeast), [filled] "r"(filled)
            : "cc");
    return taken;
#else
    const bool low = state < RansDecoder::kLeast;
    state = low ? filled : state;
    return static_cast<std::size_t>(low);
#endif
  }

  RansDecoder& decoder_;
  const std::byte* at_;
  const std::byte* end_;
  std::uint32_t state_;
};

// FastRansDecoder's aside, for coders of any kind.
template <class Coder, class Read>
[[gnu::always_inline]] inline auto code_aside(Coder& coder, Read&& read) {
  if constexpr (requires { coder.aside(read); }) {
    return coder.aside(read);
  } else {
    return read(coder);
  }
}

// What many symbols are best coded with: `auto&& fast = fast_coder(coder)`.
template <class Coder>
Coder& fast_coder(Coder& coder) {
  return coder;
}
[[gnu::always_inline]] inline FastRansDecoder fast_coder(RansDecoder& decoder) { return FastRansDecoder(decoder); }

inline int RansDecoder::symbol(const FrequencyTable& table, int value) {
  return FastRansDecoder(*this).symbol(table, value);
}
inline unsigned RansDecoder::bits(int count, unsigned value) { return FastRansDecoder(*this).bits(count, value); }

}  // namespace fanstream
