// What coding and refinement keep of each vertex.
#pragma once

#include <cstdint>
#include <cstring>

#include "common/fans/fan_split.h"
#include "common/support/vector4.h"

namespace fanstream {

inline constexpr std::uint32_t kMostGenerations = 64;
inline constexpr std::uint8_t kNeverSplit = 255;

// Generations are numbered from 1; 0 is FM0.
struct VertexContext {
  std::uint8_t touched = 0;           // that in which the vertex was last split or made
  std::uint8_t next = kNeverSplit;    // that in which it is split next
  std::uint16_t unused = 0;
};

// Sixteen bytes, so that the place loads as one vector.
struct alignas(16) FanVertex {
  GridPoint place{0};
  VertexContext context;

  // The place in the first three lanes; the fourth is of no meaning.
  Int4 place4() const {
    Int4 lanes;
    std::memcpy(&lanes, this, sizeof(lanes));
    return lanes;
  }
};
static_assert(sizeof(FanVertex) == 16);

}  // namespace fanstream
