// Places of FM0 on the lattice that its vertices are known on (PlacePrecision), which is what Draco codes, and what
// those have beyond it that are never split.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/coding/base_coder.h"
#include "common/coding/place_precision.h"

namespace fanstream {

// FM0 with points of the lattice for places.
BaseMesh base_on_lattice(const BaseMesh& base, const PlaceLattice& lattice);

// The low bits of the vertices that are never split. `places` are codes; `exact`, of the same length, says which
// vertices these are. No bytes if there are none.
std::vector<std::byte> encode_exact_places(std::span<const GridPoint> places, std::span<const std::uint8_t> exact,
                                           const PlaceLattice& lattice);
// Turns points of the lattice into codes, and says which of them are exact. Precondition: the lattice contains the
// points. Fails (bad_input) where the bytes are not what encode_exact_places gives. Safe on any bytes: an exact place
// may lie off the grid.
Result<std::vector<std::uint8_t>> decode_exact_places(std::span<const std::byte> bytes, const PlaceLattice& lattice,
                                                      std::span<GridPoint> places);

}  // namespace fanstream
