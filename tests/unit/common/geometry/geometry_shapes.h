// Shapes whose distances are known in closed form.
#pragma once

#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <map>
#include <numbers>
#include <random>
#include <utility>

#include "common/mesh/triangle_mesh.h"

namespace fanstream::geometry_shapes {

// A unit-square grid of cells x cells quads at height z.
inline TriangleMesh flat_square(unsigned cells, double z, double side = 1.0) {
  TriangleMesh mesh;
  for (unsigned y = 0; y <= cells; ++y) {
    for (unsigned x = 0; x <= cells; ++x) mesh.positions.emplace_back(side * x / cells, side * y / cells, z);
  }
  for (unsigned y = 0; y < cells; ++y) {
    for (unsigned x = 0; x < cells; ++x) {
      const VertexId v = y * (cells + 1) + x;
      mesh.triangles.push_back({v, v + 1, v + cells + 2});
      mesh.triangles.push_back({v, v + cells + 2, v + cells + 1});
    }
  }
  return mesh;
}

// An octahedron whose faces are divided into four `levels` times and pushed out to the sphere.
inline TriangleMesh octasphere(unsigned levels, double radius) {
  TriangleMesh mesh;
  mesh.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (unsigned level = 0; level < levels; ++level) {
    std::map<std::pair<VertexId, VertexId>, VertexId> middles;
    const auto middle = [&](VertexId a, VertexId b) {
      const auto [entry, is_new] = middles.try_emplace(std::minmax(a, b), static_cast<VertexId>(mesh.positions.size()));
      if (is_new) mesh.positions.push_back(glm::normalize(mesh.positions[a] + mesh.positions[b]));
      return entry->second;
    };
    std::vector<Triangle> finer;
    for (const Triangle& t : mesh.triangles) {
      const VertexId ab = middle(t[0], t[1]);
      const VertexId bc = middle(t[1], t[2]);
      const VertexId ca = middle(t[2], t[0]);
      finer.insert(finer.end(), {{t[0], ab, ca}, {t[1], bc, ab}, {t[2], ca, bc}, {ab, bc, ca}});
    }
    mesh.triangles = std::move(finer);
  }
  for (glm::dvec3& p : mesh.positions) p *= radius;
  return mesh;
}

// Triangles of all shapes and sizes, about one in five degenerate (a corner twice, three corners on a line, one point).
inline TriangleMesh random_triangles(unsigned count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&random] { return static_cast<double>(random() >> 11) * 0x1.0p-53 * 2.0 - 1.0; };
  TriangleMesh mesh;
  for (unsigned i = 0; i < count; ++i) {
    const glm::dvec3 a(uniform(), uniform(), uniform());
    const double size = std::pow(10.0, -2.0 * std::abs(uniform()));
    glm::dvec3 b = a + size * glm::dvec3(uniform(), uniform(), uniform());
    glm::dvec3 c = a + size * glm::dvec3(uniform(), uniform(), uniform());
    switch (random() % 15) {
      case 0: c = b; break;
      case 1: c = a + (b - a) * uniform() * 2.0; break;
      case 2: b = c = a; break;
      default: break;
    }
    const auto first = static_cast<VertexId>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {a, b, c});
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return mesh;
}

}  // namespace fanstream::geometry_shapes
