#include "tests/support/fan_test_meshes.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <numbers>
#include <random>
#include <utility>

namespace fanstream::test {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

// Directed edge -> the vertex opposite to it in its face, and the face.
class EdgeMap {
 public:
  void insert(const Triangle& t, std::uint32_t face) {
    for (std::size_t k = 0; k < 3; ++k) faces_[{t[k], t[(k + 1) % 3]}] = {t[(k + 2) % 3], face};
  }
  void erase(const Triangle& t) {
    for (std::size_t k = 0; k < 3; ++k) faces_.erase({t[k], t[(k + 1) % 3]});
  }
  bool contains(VertexId a, VertexId b) const { return faces_.count({a, b}) != 0; }
  std::pair<VertexId, std::uint32_t> at(VertexId a, VertexId b) const { return faces_.at({a, b}); }

 private:
  std::map<std::pair<VertexId, VertexId>, std::pair<VertexId, std::uint32_t>> faces_;
};

void flip_random_edges(TriangleMesh& mesh, std::size_t count, std::mt19937& random) {
  EdgeMap edges;
  for (std::uint32_t face = 0; face < mesh.triangles.size(); ++face) edges.insert(mesh.triangles[face], face);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t face = random() % static_cast<std::uint32_t>(mesh.triangles.size());
    const std::size_t k = random() % 3;
    const VertexId a = mesh.triangles[face][k];
    const VertexId b = mesh.triangles[face][(k + 1) % 3];
    const VertexId c = mesh.triangles[face][(k + 2) % 3];
    const auto [d, other] = edges.at(b, a);
    if (c == d || edges.contains(c, d) || edges.contains(d, c)) continue;
    edges.erase(mesh.triangles[face]);
    edges.erase(mesh.triangles[other]);
    mesh.triangles[face] = {a, d, c};
    mesh.triangles[other] = {d, b, c};
    edges.insert(mesh.triangles[face], face);
    edges.insert(mesh.triangles[other], other);
  }
}

}  // namespace

TriangleMesh make_tetrahedron() {
  return {{{1, 1, 1}, {-1, -1, 1}, {-1, 1, -1}, {1, -1, -1}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

TriangleMesh make_octahedron() { return make_double_cone(4); }

TriangleMesh make_torus(std::uint32_t rows, std::uint32_t columns) {
  TriangleMesh mesh;
  const auto id = [&](std::uint32_t r, std::uint32_t c) { return (r % rows) * columns + c % columns; };
  for (std::uint32_t r = 0; r < rows; ++r) {
    for (std::uint32_t c = 0; c < columns; ++c) {
      const double u = kTurn * r / rows;
      const double v = kTurn * c / columns;
      const double radius = 2.0 + 0.8 * std::cos(v);
      mesh.positions.emplace_back(radius * std::cos(u), radius * std::sin(u), 0.8 * std::sin(v));
      mesh.triangles.push_back({id(r, c), id(r + 1, c), id(r + 1, c + 1)});
      mesh.triangles.push_back({id(r, c), id(r + 1, c + 1), id(r, c + 1)});
    }
  }
  return mesh;
}

TriangleMesh make_double_cone(std::uint32_t sides) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 1}, {0, 0, -1}};
  for (std::uint32_t i = 0; i < sides; ++i) {
    mesh.positions.emplace_back(std::cos(kTurn * i / sides), std::sin(kTurn * i / sides), 0.0);
    const VertexId a = 2 + i;
    const VertexId b = 2 + (i + 1) % sides;
    mesh.triangles.push_back({0, a, b});
    mesh.triangles.push_back({1, b, a});
  }
  return mesh;
}

TriangleMesh make_random_sphere(std::uint32_t vertex_count, std::uint32_t seed, std::uint32_t flips_per_face) {
  std::mt19937 random(seed);
  TriangleMesh mesh = make_tetrahedron();
  for (glm::dvec3& position : mesh.positions) position = glm::normalize(position);
  while (mesh.positions.size() < vertex_count) {
    const std::size_t face = random() % mesh.triangles.size();
    const auto [a, b, c] = mesh.triangles[face];
    const auto v = static_cast<VertexId>(mesh.positions.size());
    mesh.positions.push_back(glm::normalize(mesh.positions[a] + mesh.positions[b] + mesh.positions[c]));
    mesh.triangles[face] = {a, b, v};
    mesh.triangles.push_back({b, c, v});
    mesh.triangles.push_back({c, a, v});
  }
  flip_random_edges(mesh, flips_per_face * mesh.triangles.size(), random);
  return mesh;
}

TriangleMesh punch_holes(const TriangleMesh& mesh, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<std::vector<std::uint32_t>> faces_at(mesh.positions.size());
  for (std::uint32_t face = 0; face < mesh.triangles.size(); ++face) {
    for (const VertexId vertex : mesh.triangles[face]) faces_at[vertex].push_back(face);
  }
  std::vector<bool> locked(mesh.positions.size(), false);
  std::vector<bool> removed(mesh.triangles.size(), false);
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const VertexId vertex = random() % static_cast<std::uint32_t>(mesh.positions.size());
    std::vector<std::uint32_t> hole = faces_at[vertex];
    if (random() % 2 == 0) hole.resize(1);
    const bool free = std::all_of(hole.begin(), hole.end(), [&](std::uint32_t face) {
      return std::none_of(mesh.triangles[face].begin(), mesh.triangles[face].end(),
                          [&](VertexId v) { return locked[v]; });
    });
    if (!free) continue;
    for (const std::uint32_t face : hole) {
      removed[face] = true;
      for (const VertexId v : mesh.triangles[face]) locked[v] = true;
    }
  }
  TriangleMesh punched{mesh.positions, {}};
  for (std::size_t face = 0; face < mesh.triangles.size(); ++face) {
    if (!removed[face]) punched.triangles.push_back(mesh.triangles[face]);
  }
  return punched;
}

TriangleMesh join(TriangleMesh first, const TriangleMesh& second, glm::dvec3 offset) {
  const auto base = static_cast<VertexId>(first.positions.size());
  for (const glm::dvec3& position : second.positions) first.positions.push_back(position + offset);
  for (const Triangle& t : second.triangles) first.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
  return first;
}

}  // namespace fanstream::test
