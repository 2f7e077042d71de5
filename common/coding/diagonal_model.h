// How likely an edge of the full model is to be a diagonal, that is, to lie inside a polygon of the source file.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/coding/frequency_table.h"

namespace fanstream {

// What is known of an edge before it is coded, of both its triangles alike.
struct DiagonalContext {
  // Of each triangle's other two edges: one is a diagonal; both are none; one is none; nothing is known.
  enum Side : std::uint8_t { has_one, both_none, one_none, unknown };
  std::array<Side, 2> sides{unknown, unknown};
  std::uint8_t longest = 0;   // in how many of its triangles it is the longest edge, 0 to 2
  std::uint8_t flatness = 0;  // 0: bent by 30 degrees or more; 2: by less than 8

  // The pair of sides in either order, times longest, times flatness.
  std::size_t number() const {
    static constexpr std::array<std::uint8_t, 16> kPair{0, 1, 2, 3, 1, 4, 5, 6, 2, 5, 7, 8, 3, 6, 8, 9};
    return (std::size_t{kPair[sides[0] * 4U + sides[1]]} * 3 + longest) * 3 + flatness;
  }
};
inline constexpr std::size_t kDiagonalContexts = 90;

// By context, the level of its probability: 0 to 15 are 2^-1, 2^-1.5, ... 2^-8.5, and 16 to 31 one less those.
struct DiagonalStatistics {
  std::array<std::uint8_t, kDiagonalContexts> levels{};

  // As measured on quad meshes, modelled and generated, and on one of mixed polygons; used where nothing else is said.
  static const DiagonalStatistics& built_in();
  // For edges counted by context and by whether they are diagonals: the levels that cost the fewest bits, those of
  // built_in() where others do not pay for their being told.
  static DiagonalStatistics learn(const std::array<std::array<std::uint64_t, 2>, kDiagonalContexts>& counts);
  bool operator==(const DiagonalStatistics&) const = default;

  // What differs from built_in(), as a part of the coder's stream.
  template <class Coder>
  void code(Coder& coder) {
    const FrequencyTable& differs = differs_table();
    for (std::size_t c = 0; c < kDiagonalContexts; ++c) {
      const std::uint8_t usual = built_in().levels[c];
      if (coder.symbol(differs, levels[c] != usual ? 1 : 0) == 0) {
        levels[c] = usual;
      } else {
        levels[c] = static_cast<std::uint8_t>(coder.bits(5, levels[c]));
      }
    }
  }

 private:
  static const FrequencyTable& differs_table();
};

// The tables of the statistics: symbol 1 is a diagonal. Immutable.
class DiagonalModel {
 public:
  explicit DiagonalModel(const DiagonalStatistics& statistics);
  const FrequencyTable& table(std::size_t context) const { return tables_[statistics_.levels[context]]; }

 private:
  DiagonalStatistics statistics_;
  std::vector<FrequencyTable> tables_;  // by level
};

}  // namespace fanstream
