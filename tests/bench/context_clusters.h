// Which contexts share a table.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/coding/frequency_table.h"

namespace fanstream::bench {

using SymbolCounts = std::array<double, FrequencyTable::kMaxSymbols>;

// The number of its cluster, from 0, for each context: at most `clusters`, if there are not more kinds, and only of one
// kind each. Joins step by step the two whose joint table takes the fewest bits more than their own (Ward's method with
// entropies), then moves contexts to the clusters that they take the fewest bits with. O(contexts^2) memory.
std::vector<std::uint32_t> cluster_contexts(std::span<const SymbolCounts> counts, std::span<const int> kinds,
                                            std::size_t clusters);

}  // namespace fanstream::bench
