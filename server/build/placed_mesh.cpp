#include "server/build/placed_mesh.h"

#include <algorithm>

namespace fanstream {
namespace {

// Where a point lies on a curve through the model's box that keeps neighbours together (Morton).
std::uint64_t place_on_curve(const glm::vec3& place) {
  const auto spread = [](float value) {
    std::uint64_t bits = static_cast<std::uint32_t>(value);
    bits = (bits | bits << 32U) & 0x001F00000000FFFFU;
    bits = (bits | bits << 16U) & 0x001F0000FF0000FFU;
    bits = (bits | bits << 8U) & 0x100F00F00F00F00FU;
    bits = (bits | bits << 4U) & 0x10C30C30C30C30C3U;
    return (bits | bits << 2U) & 0x1249249249249249U;
  };
  return spread(place.x) | spread(place.y) << 1U | spread(place.z) << 2U;
}

}  // namespace

PlacedMesh::PlacedMesh(const std::vector<Triangle>& triangles, std::vector<GridPoint> vertex_codes,
                       const PositionGrid& position_grid, std::uint32_t faces_of_part)
    : grid(position_grid),
      codes(std::move(vertex_codes)),
      number(numbers_by_place()),
      places(codes.size()),
      faces(placed(triangles)),
      around(codes.size(), faces) {
  for (VertexId v = 0; v < codes.size(); ++v) places[number[v]] = place_of(codes[v]);
  constexpr std::size_t kMostParts = 4;
  part_count_ = static_cast<std::uint32_t>(std::clamp<std::size_t>(faces.size() / faces_of_part, 1, kMostParts));
}

std::uint32_t PlacedMesh::part_begin(std::uint32_t part) const {
  return static_cast<std::uint32_t>(std::uint64_t{faces.size()} * part / part_count());
}

std::vector<VertexId> PlacedMesh::numbers_by_place() const {
  struct Entry {
    std::uint64_t at;
    VertexId v;
  };
  std::vector<Entry> entries(codes.size());
  for (VertexId v = 0; v < entries.size(); ++v) entries[v] = {place_on_curve(place_of(codes[v])), v};
  std::sort(entries.begin(), entries.end(),
            [](const Entry& a, const Entry& b) { return a.at != b.at ? a.at < b.at : a.v < b.v; });
  std::vector<VertexId> numbers(codes.size());
  for (std::uint32_t i = 0; i < entries.size(); ++i) numbers[entries[i].v] = i;
  return numbers;
}

// By their smallest vertices.
std::vector<Triangle> PlacedMesh::placed(const std::vector<Triangle>& triangles) const {
  std::vector<std::uint32_t> first(codes.size() + 1, 0);
  const auto smallest = [&](const Triangle& t) { return std::min({number[t[0]], number[t[1]], number[t[2]]}); };
  for (const Triangle& t : triangles) ++first[smallest(t) + 1];
  for (std::size_t v = 0; v < codes.size(); ++v) first[v + 1] += first[v];
  std::vector<Triangle> placed(triangles.size());
  for (const Triangle& t : triangles) placed[first[smallest(t)]++] = {number[t[0]], number[t[1]], number[t[2]]};
  return placed;
}

}  // namespace fanstream
