// What coding and refinement keep of each vertex.
#pragma once

#include <cstdint>
#include <cstring>

#include "common/fans/fan_split.h"
#include "common/support/vector4.h"

namespace fanstream {

// Facts about a vertex that are the same whichever legal order splits were applied in, since only splits of its own
// cell count. Generations here start at 1; 0 is the base.
struct VertexContext {
  std::uint8_t valence = 0;  // when it was last split or made, plus the wings it has been since; modulo 256
  std::uint8_t touched = 0;  // the generation of that split
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
