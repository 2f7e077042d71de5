#include "common/refine/cell_partition.h"

#include <algorithm>
#include <array>
#include <bit>
#include <glm/common.hpp>

namespace fanstream {
namespace {

// Works on places in the order that breaks ties.
struct Partitioner {
  std::span<const VertexId> vertices;
  std::vector<GridPoint> places;  // of the vertices
  glm::vec3 unit;
  std::vector<std::vector<VertexId>>& groups;
  std::vector<std::uint64_t> keys;  // of the vertices in doubt

  using Ranks = std::span<const std::uint32_t>;

  int longest_axis(Ranks ranks, GridPoint& low, GridPoint& high) const {
    low = high = places[ranks.front()];
    for (const std::uint32_t r : ranks) {
      low = glm::min(low, places[r]);
      high = glm::max(high, places[r]);
    }
    int longest = 0;
    const glm::vec3 size = glm::vec3(high - low) * unit;
    for (int axis = 1; axis < 3; ++axis) {
      if (size[axis] > size[longest]) longest = axis;
    }
    return longest;
  }

  std::int32_t code(std::uint32_t rank, int axis) const { return (&places[rank].x)[axis]; }
  std::uint64_t key(std::uint32_t rank, int axis) const {
    return std::uint64_t{static_cast<std::uint32_t>(code(rank, axis))} << 32U | rank;
  }

  // The key that `left` of the vertices are below: counted by buckets first, so that few are left to compare.
  std::uint64_t threshold(Ranks ranks, std::size_t left, int axis, std::int32_t low, std::int32_t high) {
    const auto range = static_cast<std::uint32_t>(high - low);
    const int shift = std::max(0, static_cast<int>(std::bit_width(range)) - 6);
    const auto bucket = [&](std::uint32_t r) { return static_cast<std::uint32_t>(code(r, axis) - low) >> shift; };
    std::array<std::uint32_t, 64> counts{};
    for (const std::uint32_t r : ranks) ++counts[bucket(r)];
    std::uint32_t wanted = 0;
    std::size_t below = 0;
    while (below + counts[wanted] <= left) below += counts[wanted++];
    keys.clear();
    for (const std::uint32_t r : ranks) {
      if (bucket(r) == wanted) keys.push_back(key(r, axis));
    }
    const auto nth = keys.begin() + static_cast<std::ptrdiff_t>(left - below);
    std::nth_element(keys.begin(), nth, keys.end());
    return *nth;
  }

  void cut(Ranks ranks, std::uint32_t parts) {  // recursion as deep as log2(parts)
    if (parts <= 1 || ranks.empty()) {
      std::vector<VertexId>& group = groups.emplace_back(ranks.size());
      for (std::size_t i = 0; i < ranks.size(); ++i) group[i] = vertices[ranks[i]];
      for (std::uint32_t i = 1; i < parts; ++i) groups.emplace_back();
      return;
    }
    const std::uint32_t left_parts = parts / 2;
    const std::size_t left = ranks.size() * left_parts / parts;
    GridPoint low;
    GridPoint high;
    const int axis = longest_axis(ranks, low, high);
    const std::uint64_t limit = threshold(ranks, left, axis, (&low.x)[axis], (&high.x)[axis]);
    std::vector<std::uint32_t> halves(ranks.size() + 1);
    std::size_t first = 0;
    std::size_t second = left;
    for (const std::uint32_t r : ranks) {
      const bool is_left = key(r, axis) < limit;
      halves[is_left ? first : second] = r;
      first += is_left ? 1 : 0;
      second += is_left ? 0 : 1;
    }
    cut(Ranks(halves).first(left), left_parts);
    cut(Ranks(halves).subspan(left, ranks.size() - left), parts - left_parts);
  }
};

}  // namespace

std::vector<std::vector<VertexId>> partition_vertices(std::span<const VertexId> vertices,
                                                      std::span<const FanVertex> places, const glm::vec3& unit,
                                                      std::uint32_t parts) {
  std::vector<std::vector<VertexId>> groups;
  groups.reserve(parts);
  Partitioner partitioner{vertices, {}, unit, groups, {}};
  partitioner.places.reserve(vertices.size());
  for (const VertexId v : vertices) partitioner.places.push_back(places[v].place);
  std::vector<std::uint32_t> ranks(vertices.size());
  for (std::uint32_t r = 0; r < ranks.size(); ++r) ranks[r] = r;
  partitioner.cut(ranks, parts);
  return groups;
}

}  // namespace fanstream
