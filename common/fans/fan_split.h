// The paper's FanSplit record and PFanMesh (Suzuki, Okamoto, Kanai, section 4), on an integer grid.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "common/fans/ring_mesh.h"
#include "common/support/vector4.h"

namespace fanstream {

using GridPoint = glm::ivec3;

// Where the parent lay between the two centres that were merged (the paper's g_predict).
enum class ParentPosition : std::uint8_t {
  kept = 0,    // at the centre that keeps the parent's number
  middle = 1,  // halfway, rounded as halfway_offset says
  added = 2,   // at the centre that the split adds
  free = 3,    // at a place of its own, told by its shift from halfway
};

// One split of the fan of `root`: the new vertex takes the ring from position `first` to position `last` of the root's
// ring, counted from where its fan starts (LinkedFans). Whether each of the two fans is open or closed afterwards (the
// paper's loop_predict) follows from where kOutside stands. Normals are not transmitted: they are computed from the
// fans.
struct FanSplit {
  VertexId root = 0;
  std::uint32_t first = 0;
  std::uint32_t last = 0;
  ParentPosition parent = ParentPosition::kept;
  // In points of the lattice of the split's generation (PlacePrecision), which may be coarser than the grid.
  GridPoint displacement{0};  // from the kept centre to the added one (the paper's dV)
  GridPoint shift{0};         // of a free parent: from halfway to where it lay, within kMostShift on each axis
};

// So that a shift can be kept in 45 bits where a split is to be undone.
inline constexpr std::int32_t kMostShift = (1 << 14) - 1;
inline bool is_shift(const GridPoint& s) {
  const auto in_range = [](std::int32_t v) { return v >= -kMostShift && v <= kMostShift; };
  return in_range(s.x) && in_range(s.y) && in_range(s.z);
}

// The two centres' places from the parent's, and back. The middle is rounded down in even generations and up in odd
// ones, so that repeated halving does not drift.
inline GridPoint halfway_offset(GridPoint displacement, std::uint32_t generation) {
  const int up = static_cast<int>(generation & 1U);
  return {(displacement.x + up) >> 1, (displacement.y + up) >> 1, (displacement.z + up) >> 1};
}

// By axis; the fourth lane is what the same arithmetic makes of the parent's and the displacement's.
struct SplitLanes {
  Int4 kept;
  Int4 added;
};
// By masks out of a table, since a branch would be a coin toss.
inline SplitLanes places_after_split(Int4 parent, ParentPosition position, Int4 displacement, std::uint32_t generation,
                                     const GridPoint& shift) {
  struct Shares {
    Int4 of_half;
    Int4 of_whole;
  };
  static constexpr Int4 kNone = {0, 0, 0, 0};
  static constexpr Int4 kAll = {-1, -1, -1, -1};
  static constexpr std::array<Shares, 4> kShares = {{{kNone, kNone}, {kAll, kNone}, {kNone, kAll}, {kAll, kNone}}};
  const Shares& shares = kShares[static_cast<std::size_t>(position)];
  const Int4 halfway = (displacement + int4(static_cast<std::int32_t>(generation & 1U))) >> 1;
  Int4 kept = parent - ((halfway & shares.of_half) | (displacement & shares.of_whole));
  if (position == ParentPosition::free) [[unlikely]]
    kept -= int4(shift);
  return {kept, kept + displacement};
}
struct SplitPlaces {
  GridPoint kept;
  GridPoint added;
};
inline SplitPlaces places_after_split(const GridPoint& parent, ParentPosition position, const GridPoint& displacement,
                                      std::uint32_t generation, const GridPoint& shift = GridPoint(0)) {
  const SplitLanes lanes = places_after_split(int4(parent), position, int4(displacement), generation, shift);
  return {to_ivec3(lanes.kept), to_ivec3(lanes.added)};
}
inline GridPoint place_after_merge(GridPoint kept, GridPoint added, ParentPosition position, std::uint32_t generation,
                                   const GridPoint& shift = GridPoint(0)) {
  if (position == ParentPosition::middle) return kept + halfway_offset(added - kept, generation);
  if (position == ParentPosition::free) [[unlikely]]
    return kept + halfway_offset(added - kept, generation) + shift;
  return position == ParentPosition::kept ? kept : added;
}

}  // namespace fanstream
