#include "common/coding/place_precision.h"

#include <algorithm>

namespace fanstream {
PlacePrecision::PlacePrecision(std::span<const std::uint8_t> left_out, const PositionGrid& grid) {
  for (std::uint32_t generation = 0; generation < lattices_.size(); ++generation) {
    PlaceLattice& lattice = lattices_[generation];
    for (int axis = 0; axis < 3; ++axis) {
      lattice.last[axis] = grid.code_count(axis) - 1;
      if (generation >= left_out.size() || grid.is_listed(axis)) continue;
      lattice.left_out += left_out[generation];
      lattice.shift[axis] = left_out[generation];
      lattice.half[axis] = (1 << left_out[generation]) >> 1;
    }
  }
}

std::uint32_t PlacePrecision::most_left_out(const PositionGrid& grid) {
  if (grid.is_listed(0) && grid.is_listed(1) && grid.is_listed(2)) return 0;
  return std::min(static_cast<std::uint32_t>(grid.bits() - 1), kMostLeftOut);
}

std::uint32_t PlacePrecision::left_out(std::uint32_t generation) const {
  const GridPoint& shift = lattices_[generation].shift;
  return static_cast<std::uint32_t>(std::max({shift.x, shift.y, shift.z}));
}

bool PlacePrecision::operator==(const PlacePrecision& other) const {
  return std::equal(lattices_.begin(), lattices_.end(), other.lattices_.begin(),
                    [](const PlaceLattice& a, const PlaceLattice& b) { return a.shift == b.shift; });
}

// What FM0 leaves out, then a bit for each change: 1 for a bit less, 0 for the next generation.
void PlacePrecision::write(ByteWriter& out) const {
  std::uint32_t left = left_out(0);
  out.u8(static_cast<std::uint8_t>(left));
  std::uint32_t byte = 0;
  std::uint32_t count = 0;
  const auto bit = [&](std::uint32_t value) {
    byte |= value << count++;
    if (count < 8) return;
    out.u8(static_cast<std::uint8_t>(byte));
    byte = count = 0;
  };
  for (std::uint32_t generation = 1; left > 0; ++generation) {
    bit(0);
    for (; left > left_out(generation); --left) bit(1);
  }
  if (count > 0) out.u8(static_cast<std::uint8_t>(byte));
}

Result<PlacePrecision> PlacePrecision::read(ByteReader& in, const PositionGrid& grid,
                                            std::uint32_t generation_count) {
  std::uint32_t left = in.u8();
  if (in.failed() || left > most_left_out(grid)) {
    return tl::unexpected(in.error("precision of places", "more bits left out than there are"));
  }
  std::vector<std::uint8_t> left_out{static_cast<std::uint8_t>(left)};
  std::uint32_t byte = 0;
  for (std::uint32_t at = 0; left > 0; ++at) {
    if (at % 8 == 0) byte = in.u8();
    if (((byte >> (at % 8)) & 1U) != 0) {
      left_out.back() = static_cast<std::uint8_t>(--left);
    } else if (left_out.size() <= generation_count) {
      left_out.push_back(static_cast<std::uint8_t>(left));
    } else {
      return tl::unexpected(in.error("precision of places", "bits left out by the last generation"));
    }
  }
  if (in.failed()) return tl::unexpected(in.error("precision of places", "cut short"));
  return PlacePrecision(left_out, grid);
}

}  // namespace fanstream
