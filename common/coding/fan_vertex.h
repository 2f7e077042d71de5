// What coding and refinement keep of each vertex.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>

#include "common/fans/fan_split.h"
#include "common/support/vector4.h"

namespace fanstream {

inline constexpr std::uint32_t kMostGenerations = 64;
inline constexpr std::uint8_t kNeverSplit = 255;

// Generations are numbered from 1; 0 is FM0.
struct VertexContext {
  std::uint8_t touched = 0;         // that in which the vertex was last split or made
  std::uint8_t next = kNeverSplit;  // that in which it is split next
  std::uint16_t unused = 0;

  // As one number: `touched` in the lowest eight bits, `next` in those above.
  static constexpr std::uint32_t word_of(std::uint32_t touched, std::uint32_t next) { return touched | next << 8U; }
  std::uint32_t word() const {
    if constexpr (std::endian::native == std::endian::little) return std::bit_cast<std::uint32_t>(*this);
    return word_of(touched, next);
  }
  static VertexContext of_word(std::uint32_t word) {
    return {static_cast<std::uint8_t>(word), static_cast<std::uint8_t>(word >> 8U), 0};
  }
};

// Sixteen bytes, so that the place loads as one vector.
struct alignas(16) FanVertex {
  GridPoint place{0};
  VertexContext context;

  // With the place in the first three lanes of `lanes`, and a context's word.
  void set(Int4 lanes, std::uint32_t word) {
    if constexpr (std::endian::native == std::endian::little) {
      constexpr Int4 kAxes = {-1, -1, -1, 0};
      lanes = (lanes & kAxes) | Int4{0, 0, 0, static_cast<std::int32_t>(word)};
      std::memcpy(static_cast<void*>(this), &lanes, sizeof(lanes));
    } else {
      *this = {to_ivec3(lanes), VertexContext::of_word(word)};
    }
  }
  // The place in the first three lanes; the fourth is of no meaning, but not negative.
  Int4 place4() const {
    Int4 lanes;
    std::memcpy(&lanes, this, sizeof(lanes));
    return lanes;
  }
};
static_assert(sizeof(FanVertex) == 16);

}  // namespace fanstream
