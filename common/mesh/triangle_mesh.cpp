#include "common/mesh/triangle_mesh.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numeric>

namespace fanstream {

double Bounds::diagonal() const { return glm::length(high - low); }

Bounds bounds_of(const std::vector<glm::dvec3>& positions) {
  if (positions.empty()) return {};
  Bounds box{positions.front(), positions.front()};
  for (const glm::dvec3& p : positions) {
    box.low = glm::min(box.low, p);
    box.high = glm::max(box.high, p);
  }
  return box;
}

double area_of(const TriangleMesh& mesh, const Triangle& face) {
  const glm::dvec3& a = mesh.positions[face[0]];
  return 0.5 * glm::length(glm::cross(mesh.positions[face[1]] - a, mesh.positions[face[2]] - a));
}

std::size_t count_components(std::size_t vertex_count, const std::vector<Triangle>& triangles) {
  std::vector<VertexId> parent(vertex_count);
  std::iota(parent.begin(), parent.end(), VertexId{0});
  const auto find = [&parent](VertexId v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  std::size_t components = vertex_count;
  const auto join = [&](VertexId a, VertexId b) {
    a = find(a);
    b = find(b);
    if (a == b) return;
    parent[a] = b;
    --components;
  };
  for (const Triangle& t : triangles) {
    join(t[0], t[1]);
    join(t[1], t[2]);
  }
  return components;
}

}  // namespace fanstream
