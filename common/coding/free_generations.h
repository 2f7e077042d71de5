// In which generations a vertex may be split next (next_split.h).
#pragma once

#include <bit>
#include <cstdint>

namespace fanstream {

// What is asked of sets of bits, for machines of any kind. (std::popcount is a call where the processor may lack the
// instruction.)
struct PlainBits {
  static std::uint32_t count(std::uint64_t v) {
    v -= (v >> 1U) & 0x5555555555555555U;
    v = (v & 0x3333333333333333U) + ((v >> 2U) & 0x3333333333333333U);
    return static_cast<std::uint32_t>((((v + (v >> 4U)) & 0x0F0F0F0F0F0F0F0FU) * 0x0101010101010101U) >> 56U);
  }
  // The place of the one that has `rank` below it, if there is one.
  static std::uint32_t place_of(std::uint64_t v, std::uint32_t rank) {
    for (; rank != 0 && v != 0; --rank) v &= v - 1;
    return static_cast<std::uint32_t>(std::countr_zero(v));
  }
};

// The generations from `now` on in which a vertex may be split next.
class FreeGenerations {
 public:
  FreeGenerations() = default;
  // Up to `last`, the asset's last generation. Precondition: 1 <= now <= last <= kMostGenerations.
  FreeGenerations(std::uint32_t now, std::uint32_t last) : now_(now), last_(last) {}

  void exclude(std::uint32_t generation) { taken_ |= bit_of(generation); }
  // The bit of a generation that is not before `now`, for sets of them; none for kNeverSplit.
  std::uint64_t bit_of(std::uint32_t generation) const { return bit(generation, now_); }
  static std::uint64_t bit(std::uint32_t generation, std::uint32_t now) {
    const std::uint32_t age = generation - now;
    return static_cast<std::uint64_t>(age < 64) << (age & 63U);
  }
  void exclude_set(std::uint64_t taken) { taken_ |= taken; }

  template <class Bits = PlainBits>
  [[gnu::always_inline]] std::uint32_t count() const {
    const std::uint32_t ages = last_ - now_ + 1;
    return ages - Bits::count(taken_ & (~std::uint64_t{0} >> (64 - ages)));
  }
  bool next_is_taken() const { return ((taken_ >> 1U) & 1U) != 0; }
  // Free generations before `generation`.
  std::uint32_t rank_of(std::uint32_t generation) const {
    const std::uint32_t ages = generation - now_;
    return ages - PlainBits::count(taken_ & ((std::uint64_t{1} << ages) - 1));
  }
  // Of no meaning unless rank < count().
  template <class Bits = PlainBits>
  [[gnu::always_inline]] std::uint32_t of_rank(std::uint32_t rank) const {
    return now_ + Bits::place_of(~taken_, rank);
  }

 private:
  std::uint64_t taken_ = 0;
  std::uint32_t now_ = 0;
  std::uint32_t last_ = 0;
};

}  // namespace fanstream
