#include "tests/bench/papers/ellipsoid.h"

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <numbers>

namespace fanstream::bench {
namespace {

constexpr glm::dvec3 kHalfAxes{1.0, 0.8, 0.6};

}  // namespace

TriangleMesh make_ring_ellipsoid() {
  constexpr VertexId kRings = 20;
  constexpr VertexId kSides = 20;
  TriangleMesh mesh;
  mesh.positions.push_back(kHalfAxes * glm::dvec3(0.0, 1.0, 0.0));
  for (VertexId ring = 0; ring < kRings; ++ring) {
    const double latitude = std::numbers::pi * (ring + 1) / (kRings + 1);
    for (VertexId side = 0; side < kSides; ++side) {
      const double longitude = 2.0 * std::numbers::pi * side / kSides;
      mesh.positions.push_back(kHalfAxes * glm::dvec3(std::sin(latitude) * std::sin(longitude), std::cos(latitude),
                                                      std::sin(latitude) * std::cos(longitude)));
    }
  }
  mesh.positions.push_back(kHalfAxes * glm::dvec3(0.0, -1.0, 0.0));
  const auto at = [](VertexId ring, VertexId side) { return 1 + ring * kSides + side % kSides; };
  const VertexId south = 1 + kRings * kSides;
  for (VertexId side = 0; side < kSides; ++side) {
    mesh.triangles.push_back({0, at(0, side), at(0, side + 1)});
    for (VertexId ring = 0; ring + 1 < kRings; ++ring) {
      mesh.triangles.push_back({at(ring, side), at(ring + 1, side), at(ring + 1, side + 1)});
      mesh.triangles.push_back({at(ring, side), at(ring + 1, side + 1), at(ring, side + 1)});
    }
    mesh.triangles.push_back({south, at(kRings - 1, side + 1), at(kRings - 1, side)});
  }
  return mesh;
}

TriangleMesh make_octahedral_ellipsoid() {
  constexpr int kParts = 10;
  using Place = std::array<int, 3>;  // |x| + |y| + |z| = kParts
  TriangleMesh mesh;
  std::map<Place, VertexId> number;
  const auto vertex = [&](const Place& p) {
    const auto [entry, is_new] = number.try_emplace(p, static_cast<VertexId>(mesh.positions.size()));
    if (is_new) mesh.positions.push_back(kHalfAxes * glm::normalize(glm::dvec3(p[0], p[1], p[2])));
    return entry->second;
  };
  for (int octant = 0; octant < 8; ++octant) {
    const std::array<int, 3> sign{(octant & 1) != 0 ? -1 : 1, (octant & 2) != 0 ? -1 : 1, (octant & 4) != 0 ? -1 : 1};
    const auto at = [&](int x, int y) { return vertex({sign[0] * x, sign[1] * y, sign[2] * (kParts - x - y)}); };
    const auto add = [&](VertexId a, VertexId b, VertexId c) {
      mesh.triangles.push_back(sign[0] * sign[1] * sign[2] > 0 ? Triangle{a, b, c} : Triangle{a, c, b});
    };
    for (int x = 0; x < kParts; ++x) {
      for (int y = 0; x + y < kParts; ++y) {
        add(at(x, y), at(x + 1, y), at(x, y + 1));
        if (x + y + 2 <= kParts) add(at(x + 1, y), at(x + 1, y + 1), at(x, y + 1));
      }
    }
  }
  return mesh;
}

}  // namespace fanstream::bench
