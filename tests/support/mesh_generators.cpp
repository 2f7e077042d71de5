#include "tests/support/mesh_generators.h"

#include <cmath>
#include <numbers>
#include <numeric>
#include <random>
#include <utility>

namespace fanstream::testing {
namespace {

constexpr double kTau = 2.0 * std::numbers::pi;

// The standard distributions may differ between standard libraries; these do not.
std::uint32_t below(std::mt19937_64& random, std::size_t limit) { return static_cast<std::uint32_t>(random() % limit); }
double unit(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

void add_quad(TriangleMesh& mesh, VertexId a, VertexId b, VertexId c, VertexId d) {
  mesh.triangles.push_back({a, b, c});
  mesh.triangles.push_back({a, c, d});
}

template <class T>
void shuffle(std::vector<T>& values, std::mt19937_64& random) {
  for (std::size_t i = values.size(); i > 1; --i) std::swap(values[i - 1], values[below(random, i)]);
}

}  // namespace

TriangleMesh make_tetrahedron() {
  return {{{1, 1, 1}, {-1, -1, 1}, {-1, 1, -1}, {1, -1, -1}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

TriangleMesh make_sphere(unsigned rows, unsigned columns, double radius) {
  TriangleMesh mesh;
  for (unsigned row = 1; row < rows; ++row) {
    const double polar = std::numbers::pi * row / rows;
    for (unsigned column = 0; column < columns; ++column) {
      const double around = kTau * column / columns;
      mesh.positions.emplace_back(radius * std::sin(polar) * std::cos(around),
                                  radius * std::sin(polar) * std::sin(around), radius * std::cos(polar));
    }
  }
  const VertexId north = (rows - 1) * columns;
  const VertexId south = north + 1;
  mesh.positions.emplace_back(0, 0, radius);
  mesh.positions.emplace_back(0, 0, -radius);
  for (unsigned column = 0; column < columns; ++column) {
    const unsigned next = (column + 1) % columns;
    mesh.triangles.push_back({north, column, next});
    for (unsigned row = 0; row + 2 < rows; ++row) {
      const VertexId up = row * columns;
      const VertexId down = up + columns;
      add_quad(mesh, up + column, down + column, down + next, up + next);
    }
    const VertexId last = (rows - 2) * columns;
    mesh.triangles.push_back({south, last + next, last + column});
  }
  return mesh;
}

TriangleMesh make_torus(unsigned rings, unsigned sides, double major_radius, double minor_radius) {
  TriangleMesh mesh;
  for (unsigned ring = 0; ring < rings; ++ring) {
    const double around = kTau * ring / rings;
    for (unsigned side = 0; side < sides; ++side) {
      const double tube = kTau * side / sides;
      const double reach = major_radius + minor_radius * std::cos(tube);
      mesh.positions.emplace_back(reach * std::cos(around), reach * std::sin(around), minor_radius * std::sin(tube));
      const VertexId here = ring * sides;
      const VertexId there = (ring + 1) % rings * sides;
      const unsigned next = (side + 1) % sides;
      add_quad(mesh, here + side, there + side, there + next, here + next);
    }
  }
  return mesh;
}

TriangleMesh make_grid(unsigned columns, unsigned rows) {
  TriangleMesh mesh;
  for (unsigned y = 0; y <= rows; ++y) {
    for (unsigned x = 0; x <= columns; ++x) mesh.positions.emplace_back(x, y, 0);
  }
  for (unsigned y = 0; y < rows; ++y) {
    for (unsigned x = 0; x < columns; ++x) {
      const VertexId corner = y * (columns + 1) + x;
      add_quad(mesh, corner, corner + 1, corner + columns + 2, corner + columns + 1);
    }
  }
  return mesh;
}

TriangleMesh make_terrain(unsigned columns, unsigned rows, std::uint64_t seed) {
  TriangleMesh mesh = make_grid(columns, rows);
  std::mt19937_64 random(seed);
  const double phase = kTau * unit(random);
  for (glm::dvec3& p : mesh.positions) {
    p.z = 2.0 * std::sin(0.31 * p.x + phase) * std::cos(0.23 * p.y) + 0.7 * std::sin(0.9 * p.x + 0.5 * p.y) +
          0.05 * unit(random);
  }
  return mesh;
}

TriangleMesh make_open_cylinder(unsigned sides, unsigned rows, double radius, double height) {
  TriangleMesh mesh;
  for (unsigned row = 0; row <= rows; ++row) {
    for (unsigned side = 0; side < sides; ++side) {
      const double around = kTau * side / sides;
      mesh.positions.emplace_back(radius * std::cos(around), radius * std::sin(around), height * row / rows);
    }
  }
  for (unsigned row = 0; row < rows; ++row) {
    for (unsigned side = 0; side < sides; ++side) {
      const VertexId low = row * sides;
      const VertexId high = low + sides;
      const unsigned next = (side + 1) % sides;
      add_quad(mesh, low + side, low + next, high + next, high + side);
    }
  }
  return mesh;
}

TriangleMesh make_book(unsigned pages) {
  TriangleMesh mesh{{{0, 0, 0}, {0, 0, 1}}, {}};
  for (unsigned page = 0; page < pages; ++page) {
    const double around = kTau * page / pages;
    const auto outer = static_cast<VertexId>(mesh.positions.size());
    mesh.positions.emplace_back(std::cos(around), std::sin(around), 0);
    mesh.positions.emplace_back(std::cos(around), std::sin(around), 1);
    add_quad(mesh, 0, outer, outer + 1, 1);
  }
  return mesh;
}

TriangleMesh make_moebius(unsigned segments) {
  TriangleMesh mesh;
  for (unsigned i = 0; i < segments; ++i) {
    const double around = kTau * i / segments;
    for (const double side : {-0.3, 0.3}) {
      const double reach = 1.0 + side * std::cos(around / 2);
      mesh.positions.emplace_back(reach * std::cos(around), reach * std::sin(around), side * std::sin(around / 2));
    }
    const VertexId here = 2 * i;
    const bool last = i + 1 == segments;
    add_quad(mesh, here, last ? 1 : here + 2, last ? 0 : here + 3, here + 1);
  }
  return mesh;
}

TriangleMesh make_bowtie(unsigned fan_faces) {
  TriangleMesh mesh{{{0, 0, 0}}, {}};
  for (const double start : {-std::numbers::pi / 4, std::numbers::pi * 3 / 4}) {
    for (unsigned i = 0; i <= fan_faces; ++i) {
      const double around = start + std::numbers::pi / 2 * i / fan_faces;
      mesh.positions.emplace_back(std::cos(around), std::sin(around), 0);
      if (i == 0) continue;
      const auto last = static_cast<VertexId>(mesh.positions.size() - 1);
      mesh.triangles.push_back({0, last - 1, last});
    }
  }
  return mesh;
}

TriangleMesh make_random_soup(unsigned vertex_count, unsigned triangle_count, std::uint64_t seed,
                              bool duplicate_positions) {
  std::mt19937_64 random(seed);
  TriangleMesh mesh;
  for (unsigned i = 0; i < vertex_count; ++i) {
    const bool copy = duplicate_positions && i > 0 && below(random, 4) == 0;
    if (copy) {
      const glm::dvec3 original = mesh.positions[below(random, i)];
      mesh.positions.push_back(original);
    } else {
      const double x = unit(random);
      const double y = unit(random);
      mesh.positions.emplace_back(x, y, unit(random));
    }
  }
  for (unsigned i = 0; i < triangle_count; ++i) {
    const VertexId a = below(random, vertex_count);
    const VertexId b = below(random, vertex_count);
    mesh.triangles.push_back({a, b, below(random, vertex_count)});
  }
  return mesh;
}

TriangleMesh explode(const TriangleMesh& mesh) {
  TriangleMesh exploded;
  for (const Triangle& t : mesh.triangles) {
    const auto first = static_cast<VertexId>(exploded.positions.size());
    for (const VertexId v : t) exploded.positions.push_back(mesh.positions[v]);
    exploded.triangles.push_back({first, first + 1, first + 2});
  }
  return exploded;
}

void append(TriangleMesh& mesh, const TriangleMesh& other, const glm::dvec3& offset) {
  const auto first = static_cast<VertexId>(mesh.positions.size());
  for (const glm::dvec3& p : other.positions) mesh.positions.push_back(p + offset);
  for (const Triangle& t : other.triangles) mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

TriangleMesh shuffled(const TriangleMesh& mesh, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<VertexId> old_of_new(mesh.positions.size());
  std::iota(old_of_new.begin(), old_of_new.end(), VertexId{0});
  shuffle(old_of_new, random);
  std::vector<VertexId> new_of_old(old_of_new.size());
  TriangleMesh result;
  for (const VertexId old : old_of_new) {
    new_of_old[old] = static_cast<VertexId>(result.positions.size());
    result.positions.push_back(mesh.positions[old]);
  }
  for (const Triangle& t : mesh.triangles) {
    const std::size_t r = below(random, 3);
    result.triangles.push_back({new_of_old[t[r]], new_of_old[t[(r + 1) % 3]], new_of_old[t[(r + 2) % 3]]});
  }
  shuffle(result.triangles, random);
  return result;
}

}  // namespace fanstream::testing
