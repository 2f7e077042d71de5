// In which generation a vertex is split next: told when it is made or split, so that whoever holds a mesh knows of
// every vertex what is still to come, and a decoder need not look at vertices that stay as they are.
//
// Neighbours are never split in one generation (CODING.md, section 9), and two vertices stay neighbours until one of
// them is split. So the generations in which a vertex's neighbours are split next are out of the question for its own
// next split, and what is coded is how many others come before it.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <span>

#include "common/coding/fan_vertex.h"
#include "common/coding/large_value.h"
#include "common/coding/split_model.h"

namespace fanstream {

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

  std::uint32_t count() const {
    const std::uint32_t ages = last_ - now_ + 1;
    return ages - ones(taken_ & (~std::uint64_t{0} >> (64 - ages)));
  }
  bool next_is_taken() const { return ((taken_ >> 1U) & 1U) != 0; }
  // Free generations before `generation`.
  std::uint32_t rank_of(std::uint32_t generation) const {
    const std::uint32_t ages = generation - now_;
    return ages - ones(taken_ & ((std::uint64_t{1} << ages) - 1));
  }
  // Precondition: rank < count().
  std::uint32_t of_rank(std::uint32_t rank) const {
    std::uint64_t free = ~taken_;
    for (; rank != 0; --rank) free &= free - 1;
    return now_ + static_cast<std::uint32_t>(std::countr_zero(free));
  }

 private:
  // As std::popcount, which is a call where the processor may lack the instruction.
  static std::uint32_t ones(std::uint64_t v) {
    v -= (v >> 1U) & 0x5555555555555555U;
    v = (v & 0x3333333333333333U) + ((v >> 2U) & 0x3333333333333333U);
    return static_cast<std::uint32_t>((((v + (v >> 4U)) & 0x0F0F0F0F0F0F0F0FU) * 0x0101010101010101U) >> 56U);
  }

  std::uint64_t taken_ = 0;
  std::uint32_t now_ = 0;
  std::uint32_t last_ = 0;
};

// Codes the generation of a vertex's next split, or kNeverSplit. `valence`: the size of its ring, kOutside included.
template <class Coder>
[[gnu::always_inline]] inline std::uint8_t code_next_split(Coder& coder, const SplitModel& model, NextSplitOf whose,
                                                           std::uint32_t valence, const FreeGenerations& free,
                                                           std::uint8_t generation) {
  const std::uint32_t count = free.count();
  if (count == 0) return kNeverSplit;
  const int index = SymbolContexts::next_split(whose, count, free.next_is_taken(), valence);
  const FrequencyTable& table = model.symbols[static_cast<std::size_t>(index)];
  std::uint32_t rank = count;
  if constexpr (!Coder::kDecodes) {
    if (generation != kNeverSplit) rank = free.rank_of(generation);
  }
  if (count < SymbolContexts::kManyFree && whose != NextSplitOf::base) {
    rank = static_cast<std::uint32_t>(coder.symbol(table, static_cast<int>(rank)));
  } else {
    rank = code_large(coder, table, rank);
  }
  return rank < count ? static_cast<std::uint8_t>(free.of_rank(rank)) : kNeverSplit;
}

// The same for all vertices of FM0, by number; `next` has an entry for each. `fans` are those of FM0.
template <class Coder, class Fans>
void code_base_splits(Coder& coder, const SplitModel& model, const Fans& fans, std::uint32_t last_generation,
                      std::span<std::uint8_t> next) {
  for (VertexId v = 0; v < next.size(); ++v) {
    FreeGenerations free(1, last_generation);
    fans.for_each_neighbour(v, [&](VertexId w) {
      if (w < v) free.exclude(next[w]);
    });
    next[v] = code_next_split(coder, model, NextSplitOf::base, fans.ring_size(v), free, next[v]);
  }
}

}  // namespace fanstream
