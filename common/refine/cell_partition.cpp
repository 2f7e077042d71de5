#include "common/refine/cell_partition.h"

#include <algorithm>

namespace fanstream {
namespace {

struct Partitioner {
  std::span<const FanVertex> places;
  glm::vec3 unit;
  std::vector<std::vector<VertexId>>& groups;

  int longest_axis(std::span<const VertexId> vertices) const {
    GridPoint low = places[vertices.front()].place;
    GridPoint high = low;
    for (const VertexId v : vertices) {
      for (int axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], places[v].place[axis]);
        high[axis] = std::max(high[axis], places[v].place[axis]);
      }
    }
    int longest = 0;
    const glm::vec3 size = glm::vec3(high - low) * unit;
    for (int axis = 1; axis < 3; ++axis) {
      if (size[axis] > size[longest]) longest = axis;
    }
    return longest;
  }

  void cut(std::span<VertexId> vertices, std::uint32_t parts) {  // recursion as deep as log2(parts)
    if (parts <= 1 || vertices.empty()) {
      groups.emplace_back(vertices.begin(), vertices.end());
      std::sort(groups.back().begin(), groups.back().end());
      for (std::uint32_t i = 1; i < parts; ++i) groups.emplace_back();
      return;
    }
    const std::uint32_t left_parts = parts / 2;
    const std::size_t left = vertices.size() * left_parts / parts;
    const int axis = longest_axis(vertices);
    std::nth_element(vertices.begin(), vertices.begin() + static_cast<std::ptrdiff_t>(left), vertices.end(),
                     [&](VertexId a, VertexId b) {
                       return places[a].place[axis] != places[b].place[axis] ? places[a].place[axis] < places[b].place[axis] : a < b;
                     });
    cut(vertices.first(left), left_parts);
    cut(vertices.subspan(left), parts - left_parts);
  }
};

}  // namespace

std::vector<std::vector<VertexId>> partition_vertices(std::vector<VertexId> vertices, std::span<const FanVertex> places,
                                                      const glm::vec3& unit, std::uint32_t parts) {
  std::vector<std::vector<VertexId>> groups;
  groups.reserve(parts);
  Partitioner{places, unit, groups}.cut(vertices, parts);
  return groups;
}

}  // namespace fanstream
