#include "common/mesh/mesh_hash.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <tuple>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace fanstream {
namespace {

using Corners = std::array<double, 9>;

Corners corners_of(const TriangleMesh& mesh, const Triangle& triangle, std::size_t start) {
  Corners corners{};
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::dvec3& p = mesh.positions[triangle[(start + i) % 3]];
    // Adding 0.0 turns -0.0 into 0.0: the same place, the same bits.
    corners[3 * i] = p.x + 0.0;
    corners[3 * i + 1] = p.y + 0.0;
    corners[3 * i + 2] = p.z + 0.0;
  }
  return corners;
}

void append_hex(std::uint64_t value, std::string& text) {
  for (int shift = 60; shift >= 0; shift -= 4) text += "0123456789abcdef"[(value >> shift) & 15U];
}

}  // namespace

std::string mesh_hash(const TriangleMesh& mesh) {
  std::uint64_t low = mesh.triangles.size();
  std::uint64_t high = mesh.positions.size();
  for (const Triangle& triangle : mesh.triangles) {
    const Corners corners =
        std::min({corners_of(mesh, triangle, 0), corners_of(mesh, triangle, 1), corners_of(mesh, triangle, 2)});
    const XXH128_hash_t hash = XXH3_128bits(corners.data(), sizeof corners);
    low += hash.low64;
    high += hash.high64;
  }
  std::string text;
  append_hex(high, text);
  append_hex(low, text);
  return text;
}

}  // namespace fanstream
