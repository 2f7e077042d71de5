#include "common/refine/cell_partition.h"

#include <algorithm>
#include <array>
#include <bit>
#include <glm/common.hpp>

namespace fanstream {
namespace {

struct Partitioner {
  std::span<const FanVertex> places;
  glm::vec3 unit;
  std::vector<std::vector<VertexId>>& groups;
  std::vector<std::uint64_t> keys;  // of the vertices in doubt

  int longest_axis(std::span<const VertexId> vertices, GridPoint& low, GridPoint& high) const {
    low = high = places[vertices.front()].place;
    for (const VertexId v : vertices) {
      low = glm::min(low, places[v].place);
      high = glm::max(high, places[v].place);
    }
    int longest = 0;
    const glm::vec3 size = glm::vec3(high - low) * unit;
    for (int axis = 1; axis < 3; ++axis) {
      if (size[axis] > size[longest]) longest = axis;
    }
    return longest;
  }

  std::int32_t code(VertexId v, int axis) const { return (&places[v].place.x)[axis]; }
  std::uint64_t key(VertexId v, int axis) const {
    return std::uint64_t{static_cast<std::uint32_t>(code(v, axis))} << 32U | v;
  }

  // The key that `left` of the vertices are below: counted by buckets first, so that few are left to compare.
  std::uint64_t threshold(std::span<const VertexId> vertices, std::size_t left, int axis, std::int32_t low,
                          std::int32_t high) {
    const auto range = static_cast<std::uint32_t>(high - low);
    const int shift = std::max(0, static_cast<int>(std::bit_width(range)) - 6);
    const auto bucket = [&](VertexId v) { return static_cast<std::uint32_t>(code(v, axis) - low) >> shift; };
    std::array<std::uint32_t, 64> counts{};
    for (const VertexId v : vertices) ++counts[bucket(v)];
    std::uint32_t wanted = 0;
    std::size_t below = 0;
    while (below + counts[wanted] <= left) below += counts[wanted++];
    keys.clear();
    for (const VertexId v : vertices) {
      if (bucket(v) == wanted) keys.push_back(key(v, axis));
    }
    const auto nth = keys.begin() + static_cast<std::ptrdiff_t>(left - below);
    std::nth_element(keys.begin(), nth, keys.end());
    return *nth;
  }

  void cut(std::span<const VertexId> vertices, std::uint32_t parts) {  // recursion as deep as log2(parts)
    if (parts <= 1 || vertices.empty()) {
      groups.emplace_back(vertices.begin(), vertices.end());
      for (std::uint32_t i = 1; i < parts; ++i) groups.emplace_back();
      return;
    }
    const std::uint32_t left_parts = parts / 2;
    const std::size_t left = vertices.size() * left_parts / parts;
    GridPoint low;
    GridPoint high;
    const int axis = longest_axis(vertices, low, high);
    const std::uint64_t limit = threshold(vertices, left, axis, (&low.x)[axis], (&high.x)[axis]);
    std::vector<VertexId> halves(vertices.size() + 1);
    std::size_t first = 0;
    std::size_t second = left;
    for (const VertexId v : vertices) {
      const bool is_left = key(v, axis) < limit;
      halves[is_left ? first : second] = v;
      first += is_left ? 1 : 0;
      second += is_left ? 0 : 1;
    }
    cut(std::span<const VertexId>(halves).first(left), left_parts);
    cut(std::span<const VertexId>(halves).subspan(left, vertices.size() - left), parts - left_parts);
  }
};

}  // namespace

std::vector<std::vector<VertexId>> partition_vertices(std::vector<VertexId> vertices, std::span<const FanVertex> places,
                                                      const glm::vec3& unit, std::uint32_t parts) {
  std::vector<std::vector<VertexId>> groups;
  groups.reserve(parts);
  if (!std::is_sorted(vertices.begin(), vertices.end())) std::sort(vertices.begin(), vertices.end());
  Partitioner{places, unit, groups, {}}.cut(vertices, parts);
  return groups;
}

}  // namespace fanstream
