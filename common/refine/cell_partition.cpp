#include "common/refine/cell_partition.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <memory>

namespace fanstream {
namespace {

// What is compared, side by side in memory.
struct alignas(16) PlacedVertex {
  GridPoint place;
  std::uint32_t rank;  // in the order that breaks ties
  std::int32_t code(int axis) const { return (&place.x)[axis]; }
  std::uint64_t key(int axis) const { return std::uint64_t{static_cast<std::uint32_t>(code(axis))} << 32U | rank; }
  Int4 lanes() const {  // the place, and whatever
    Int4 result;
    std::memcpy(&result, this, sizeof(result));
    return result;
  }
};
static_assert(sizeof(PlacedVertex) == sizeof(Int4));

struct Partitioner {
  std::span<const VertexId> ids;  // by rank
  glm::vec3 unit;
  std::vector<std::vector<VertexId>>& groups;
  std::vector<std::uint64_t> keys;  // of the vertices in doubt

  int longest_axis(std::span<const PlacedVertex> vertices, GridPoint& low, GridPoint& high) const {
    Int4 least = vertices.front().lanes();
    Int4 most = least;
    for (const PlacedVertex& v : vertices) {
      const Int4 place = v.lanes();
      least = place < least ? place : least;
      most = place > most ? place : most;
    }
    low = to_ivec3(least);
    high = to_ivec3(most);
    int longest = 0;
    const glm::vec3 size = glm::vec3(high - low) * unit;
    for (int axis = 1; axis < 3; ++axis) {
      if (size[axis] > size[longest]) longest = axis;
    }
    return longest;
  }

  // The key that `left` of the vertices are below: counted by buckets first, so that few are left to compare.
  std::uint64_t threshold(std::span<const PlacedVertex> vertices, std::size_t left, int axis, std::int32_t low,
                          std::int32_t high) {
    const auto range = static_cast<std::uint32_t>(high - low);
    const int shift = std::max(0, static_cast<int>(std::bit_width(range)) - 6);
    const auto bucket = [&](const PlacedVertex& v) { return static_cast<std::uint32_t>(v.code(axis) - low) >> shift; };
    std::array<std::uint32_t, 64> counts{};
    for (const PlacedVertex& v : vertices) ++counts[bucket(v)];
    std::uint32_t wanted = 0;
    std::size_t below = 0;
    while (below + counts[wanted] <= left) below += counts[wanted++];
    keys.resize(vertices.size());
    std::size_t in_doubt = 0;
    for (const PlacedVertex& v : vertices) {
      keys[in_doubt] = v.key(axis);
      in_doubt += bucket(v) == wanted ? 1 : 0;
    }
    const auto nth = keys.begin() + static_cast<std::ptrdiff_t>(left - below);
    std::nth_element(keys.begin(), nth, keys.begin() + static_cast<std::ptrdiff_t>(in_doubt));
    return *nth;
  }

  // Of vertices in order of their ranks; `room` is for as many and one more. Recursion as deep as log2(parts).
  void cut(std::span<const PlacedVertex> vertices, std::span<PlacedVertex> room, std::uint32_t parts) {
    if (parts <= 1 || vertices.empty()) {
      std::vector<VertexId>& group = groups.emplace_back(vertices.size());
      for (std::size_t i = 0; i < vertices.size(); ++i) group[i] = ids[vertices[i].rank];
      for (std::uint32_t i = 1; i < parts; ++i) groups.emplace_back();
      return;
    }
    const std::uint32_t left_parts = parts / 2;
    const std::size_t left = vertices.size() * left_parts / parts;
    GridPoint low;
    GridPoint high;
    const int axis = longest_axis(vertices, low, high);
    const std::uint64_t limit = threshold(vertices, left, axis, (&low.x)[axis], (&high.x)[axis]);
    const std::span<PlacedVertex> halves = room.first(vertices.size() + 1);
    std::size_t first = 0;
    std::size_t second = left;
    for (const PlacedVertex& v : vertices) {
      // Without a branch, which would be a coin toss.
      const auto is_left = static_cast<std::size_t>(v.key(axis) < limit);
      halves[second ^ ((first ^ second) & (0 - is_left))] = v;
      first += is_left;
      second += 1 - is_left;
    }
    const std::span<PlacedVertex> further = room.subspan(halves.size());
    cut(halves.first(left), further, left_parts);
    cut(halves.subspan(left, vertices.size() - left), further, parts - left_parts);
  }
};

}  // namespace

std::vector<std::vector<VertexId>> partition_vertices(std::span<const VertexId> vertices,
                                                      std::span<const FanVertex> places, const glm::vec3& unit,
                                                      std::uint32_t parts) {
  std::vector<std::vector<VertexId>> groups;
  groups.reserve(parts);
  const auto levels = static_cast<std::size_t>(std::bit_width(parts));
  const std::size_t size = (levels + 1) * (vertices.size() + 1);
  const auto memory = std::make_unique_for_overwrite<PlacedVertex[]>(size);
  const std::span<PlacedVertex> room(memory.get(), size);
  for (std::uint32_t r = 0; r < vertices.size(); ++r) room[r] = {places[vertices[r]].place, r};
  const std::span<PlacedVertex> all = room.first(vertices.size());
  Partitioner{vertices, unit, groups, {}}.cut(all, room.subspan(all.size()), parts);
  return groups;
}

}  // namespace fanstream
