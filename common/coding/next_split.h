// In which generation a vertex is split next: told when it is made or split, so that whoever holds a mesh knows of
// every vertex what is still to come, and a decoder need not look at vertices that stay as they are.
//
// Neighbours are never split in one generation (CODING.md, section 9), and two vertices stay neighbours until one of
// them is split. So the generations in which a vertex's neighbours are split next are out of the question for its own
// next split, and what is coded is how many others come before it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "common/coding/fan_vertex.h"
#include "common/coding/free_generations.h"
#include "common/coding/large_value.h"
#include "common/coding/split_model.h"

namespace fanstream {

// Codes the generation of a vertex's next split, or kNeverSplit. `valence`: the size of its ring, kOutside included.
template <class Bits = PlainBits, class Coder>
[[gnu::always_inline]] inline std::uint8_t code_next_split(Coder& coder, const PhaseModel& model, NextSplitOf whose,
                                                           std::uint32_t valence, const FreeGenerations& free,
                                                           std::uint8_t generation) {
  const std::uint32_t count = free.count<Bits>();
  if (count == 0) return kNeverSplit;
  const int index = SymbolContexts::next_split(whose, count, free.next_is_taken(), valence);
  const FrequencyTable& table = model.table(static_cast<std::size_t>(index));
  std::uint32_t rank = count;
  if constexpr (!Coder::kDecodes) {
    if (generation != kNeverSplit) rank = free.rank_of(generation);
  }
  if (count < SymbolContexts::kManyFree && whose != NextSplitOf::base) {
    rank = static_cast<std::uint32_t>(coder.symbol(table, static_cast<int>(rank)));
  } else {
    rank = code_large(coder, table, rank);
  }
  const std::uint32_t found = free.of_rank<Bits>(rank);
  const std::uint32_t never = std::uint32_t{0} - static_cast<std::uint32_t>(rank >= count);  // a coin toss
  return static_cast<std::uint8_t>((found & ~never) | (kNeverSplit & never));
}

// The same for all vertices of FM0, by number; `next` has an entry for each. `fans` are those of FM0.
template <class Coder, class Fans>
void code_base_splits(Coder& coder, const SplitModel& model, const Fans& fans, std::uint32_t last_generation,
                      std::span<std::uint8_t> next) {
  const PhaseModel& phase = model.phase(CodingPhase::kFirst);
  for (VertexId v = 0; v < next.size(); ++v) {
    FreeGenerations free(1, last_generation);
    fans.for_each_neighbour(v, [&](VertexId w) {
      if (w < v) free.exclude(next[w]);
    });
    next[v] = code_next_split(coder, phase, NextSplitOf::base, fans.ring_size(v), free, next[v]);
  }
}

}  // namespace fanstream
