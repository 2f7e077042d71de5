#include "common/coding/place_precision.h"

#include <algorithm>
#include <bit>
#include <vector>

namespace fanstream {
PlacePrecision::PlacePrecision(std::span<const std::uint8_t> left_out, const PositionGrid& grid) {
  for (std::uint32_t generation = 0; generation < lattices_.size(); ++generation) {
    PlaceLattice& lattice = lattices_[generation];
    for (int axis = 0; axis < 3; ++axis) {
      lattice.last[axis] = grid.code_count(axis) - 1;
      if (generation >= left_out.size() || grid.is_listed(axis)) continue;
      const int bits = std::bit_width(static_cast<std::uint32_t>(lattice.last[axis]));
      lattice.shift[axis] = std::min<std::int32_t>(left_out[generation], std::max(bits - 1, 0));
      lattice.half[axis] = (1 << lattice.shift[axis]) >> 1;
      lattice.left_out += static_cast<std::uint32_t>(lattice.shift[axis]);
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
void PlacePrecision::write(BitWriter& out) const {
  std::uint32_t left = left_out(0);
  out.bits(kLeftOutBits, left);
  for (std::uint32_t generation = 1; left > 0; ++generation) {
    out.bit(false);
    for (; left > left_out(generation); --left) out.bit(true);
  }
}

Result<PlacePrecision> PlacePrecision::read(BitReader& in, const PositionGrid& grid, std::uint32_t generation_count) {
  const auto impossible = [&] { return tl::unexpected(in.bytes().error("precision of places", "impossible")); };
  std::uint32_t left = in.bits(kLeftOutBits);
  if (left > most_left_out(grid)) return impossible();
  std::vector<std::uint8_t> left_out{static_cast<std::uint8_t>(left)};
  while (left > 0) {
    if (in.bit()) {
      left_out.back() = static_cast<std::uint8_t>(--left);
    } else if (left_out.size() <= generation_count) {
      left_out.push_back(static_cast<std::uint8_t>(left));
    } else {
      return impossible();  // the last generation leaves out nothing
    }
  }
  if (in.bytes().failed()) return impossible();
  return PlacePrecision(left_out, grid);
}

}  // namespace fanstream
