// A split on its way between values and symbols.
#pragma once

#include <cstdint>

#include "common/coding/free_generations.h"
#include "common/coding/place_precision.h"
#include "common/coding/ring_geometry.h"
#include "common/coding/split_model.h"

namespace fanstream {

struct SplitInProgress {
  RingGeometry ring;  // of the root, to be assigned before
  FanSplit split;     // given to an encoder, found by a decoder; wings are ring positions
  // The generations in which root and new vertex are split next: given to an encoder, found by a decoder.
  std::uint8_t root_next = kNeverSplit;
  std::uint8_t added_next = kNeverSplit;
  // What the lattices on which the two are known afterwards have beyond the generation's: likewise.
  LowBits kept_low = 0;
  LowBits added_low = 0;
  std::uint32_t length = 1;  // of the arc, in ring steps
  std::uint32_t rank = 0;    // of the arc among those of its length; on an open ring, from the gap
  Opening opening = Opening::closed;
  FreeGenerations root_free;
  FreeGenerations added_free;
};

// Where in the asset's generations a batch of splits stands.
struct CodingTime {
  std::uint32_t generation = 1;
  std::uint32_t last = 1;  // of the asset
};

}  // namespace fanstream
