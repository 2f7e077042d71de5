// How exactly the places of vertices are known while they are to be split again.
//
// A coarse mesh is off the model by many steps of the grid; there the low bits of its places are noise that costs
// bytes. So each generation has a lattice, a coarser grid that leaves low bits out, and a vertex that was last split or
// made in generation t, and is split next in s, is known on the lattice of t, or of s - kLongestRest where that is
// finer: one that stays where it is for long would be off by more than the levels that show it. A vertex that is never
// split again is known exactly, one of FM0 on the lattice of 0 until it is split. All that is left out comes with later
// splits: what is known of a vertex follows from its VertexContext alone, however the mesh came to be.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "common/coding/fan_vertex.h"
#include "common/grid/position_grid.h"
#include "common/support/bit_io.h"

namespace fanstream {

// Every 2^shift-th code of each axis, by number: points of the lattice are codes without their low bits.
struct PlaceLattice {
  GridPoint shift{0};                                        // bits left out, by axis
  GridPoint half{0};                                         // of its cells; 0 on an exact axis
  GridPoint last{std::numeric_limits<std::int32_t>::max()};  // the largest code of each axis, where it is known
  std::uint32_t left_out = 0;                                // bits, all axes together

  bool is_exact() const { return left_out == 0; }
  glm::vec3 cell_size() const { return {1 << shift.x, 1 << shift.y, 1 << shift.z}; }  // in codes
  GridPoint point_of(const GridPoint& code) const { return {code.x >> shift.x, code.y >> shift.y, code.z >> shift.z}; }
  bool contains(const GridPoint& point) const {
    const auto within = [](std::int32_t value, std::int32_t most) {
      return static_cast<std::uint32_t>(value) <= static_cast<std::uint32_t>(most);
    };
    return within(point.x, last.x >> shift.x) && within(point.y, last.y >> shift.y) &&
           within(point.z, last.z >> shift.z);
  }
  // The code that stands for a point: in the middle of its cell. Precondition: contains(point).
  GridPoint code_of(const GridPoint& point) const {
    const auto middle = [](std::int32_t p, std::int32_t bits, std::int32_t to_middle, std::int32_t most) {
      return std::min((p << bits) + to_middle, most);
    };
    return {middle(point.x, shift.x, half.x, last.x), middle(point.y, shift.y, half.y, last.y),
            middle(point.z, shift.z, half.z, last.z)};
  }
};

// What a finer lattice has of a point beyond a coarser one: the low bits of the axes behind one another, x lowest.
using LowBits = std::uint64_t;

// From a coarser lattice to a finer one, or to the codes themselves.
struct LatticeStep {
  GridPoint bits;           // by axis
  std::uint32_t bit_count;  // all together
  LatticeStep(const PlaceLattice& from, const PlaceLattice& to)
      : bits(from.shift - to.shift), bit_count(from.left_out - to.left_out) {}
  explicit LatticeStep(const PlaceLattice& to_codes) : bits(to_codes.shift), bit_count(to_codes.left_out) {}

  LowBits low_bits_of(const GridPoint& fine) const {
    const auto low = [](std::int32_t value, std::int32_t count) {
      return static_cast<LowBits>(static_cast<std::uint32_t>(value) & ((1U << count) - 1U));
    };
    return low(fine.x, bits.x) | low(fine.y, bits.y) << bits.x | low(fine.z, bits.z) << (bits.x + bits.y);
  }
  GridPoint coarse(const GridPoint& fine) const { return {fine.x >> bits.x, fine.y >> bits.y, fine.z >> bits.z}; }
  GridPoint fine(const GridPoint& coarse, LowBits low) const {
    const auto joined = [](std::int32_t upper, std::int32_t count, LowBits lower) {
      return (upper << count) | static_cast<std::int32_t>(static_cast<std::uint32_t>(lower) & ((1U << count) - 1U));
    };
    return {joined(coarse.x, bits.x, low), joined(coarse.y, bits.y, low >> bits.x),
            joined(coarse.z, bits.z, low >> (bits.x + bits.y))};
  }

  // Raw, the low ones first.
  template <class Coder>
  [[gnu::always_inline]] LowBits code(Coder& coder, LowBits low) const {
    constexpr std::uint32_t kAtOnce = 15;
    if (bit_count <= kAtOnce) [[likely]]
      return coder.bits(static_cast<int>(bit_count), static_cast<unsigned>(low));
    LowBits result = 0;
    for (std::uint32_t done = 0; done < bit_count; done += kAtOnce) {
      const std::uint32_t count = std::min(kAtOnce, bit_count - done);
      const unsigned part = static_cast<unsigned>(low >> done) & ((1U << count) - 1U);
      result |= static_cast<LowBits>(coder.bits(static_cast<int>(count), part)) << done;
    }
    return result;
  }
};

// The lattices of all generations. Immutable once made.
class PlacePrecision {
 public:
  static constexpr std::uint32_t kMostLeftOut = 12;  // bits of an axis
  // Generations that a place may be known no better than when it was touched last.
  static constexpr std::uint32_t kLongestRest = 6;

  // Everything is known exactly.
  PlacePrecision() = default;
  // `left_out`: the bits that each generation leaves out of an axis, from FM0 on; of an axis with listed values, none,
  // and of a short one at most all but the highest.
  // Precondition: none exceeds most_left_out(grid), none is more than the one before, and there are at most
  // kMostGenerations + 1; generations behind the last leave out nothing.
  PlacePrecision(std::span<const std::uint8_t> left_out, const PositionGrid& grid);
  // 0 if all axes are listed.
  static std::uint32_t most_left_out(const PositionGrid& grid);

  bool is_exact() const { return lattices_[0].is_exact(); }  // in all generations
  std::uint32_t left_out(std::uint32_t generation) const;    // bits of an axis
  const PlaceLattice& lattice(std::uint32_t generation) const { return lattices_[generation]; }
  // Of which generation the lattice is on which a vertex is known that was last touched in one, and is split next in
  // another; kMostGenerations, whose lattice is exact, where it never is.
  static std::uint32_t known_in(std::uint32_t touched, std::uint32_t next) {
    if (next == kNeverSplit) return kMostGenerations;
    if (touched == 0) return 0;
    return std::max(touched, next > kLongestRest ? next - kLongestRest : 0);
  }
  const PlaceLattice& known(std::uint32_t touched, std::uint32_t next) const {
    return lattices_[known_in(touched, next)];
  }
  // Of a vertex as its context says, given where it lies: what is shown of it.
  GridPoint shown(const GridPoint& code, const VertexContext& context) const {
    if (context.next == kNeverSplit) return code;
    const PlaceLattice& lattice = known(context.touched, context.next);
    return lattice.code_of(lattice.point_of(code));
  }
  bool operator==(const PlacePrecision& other) const;

  // read() fails on anything malformed and names the byte. `generation_count`: of the asset, whose last generation
  // leaves out nothing.
  void write(BitWriter& out) const;
  static Result<PlacePrecision> read(BitReader& in, const PositionGrid& grid, std::uint32_t generation_count);

 private:
  static constexpr int kLeftOutBits = 4;
  std::array<PlaceLattice, kMostGenerations + 1> lattices_{};
};

}  // namespace fanstream
