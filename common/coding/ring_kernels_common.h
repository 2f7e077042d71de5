// Private to the ring_kernels sources: what both need before their own text.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

#include "common/coding/split_coder.h"

namespace fanstream {

// Where VertexContext::next lies in a vertex's fourth word.
inline constexpr int kNextShift = std::endian::native == std::endian::little ? 8 : 16;

// For rings of any length.
std::uint32_t nth_reach_of_long(const RingGeometry& ring, std::uint32_t length, std::uint32_t rank,
                                decltype(RingKernels::find_reaches) find_reaches);

}  // namespace fanstream
