#include <algorithm>

#include "common/refine/progressive_mesh.h"

namespace fanstream {
namespace {

// By their smallest vertices, which stand first; ties by the next vertex. So equal meshes have their triangles in equal
// order.
std::vector<Triangle> in_order(const std::vector<Triangle>& triangles, std::size_t vertex_count) {
  std::vector<std::uint32_t> begin(vertex_count + 1, 0);
  for (const Triangle& t : triangles) ++begin[std::min({t[0], t[1], t[2]}) + 1];
  for (std::size_t v = 0; v < vertex_count; ++v) begin[v + 1] += begin[v];
  std::vector<Triangle> ordered(triangles.size());
  std::vector<std::uint32_t> fill(begin.begin(), begin.end() - 1);
  for (Triangle t : triangles) {
    while (t[0] > t[1] || t[0] > t[2]) t = {t[1], t[2], t[0]};
    ordered[fill[t[0]]++] = t;
  }
  for (std::size_t v = 0; v < vertex_count; ++v) std::sort(ordered.begin() + begin[v], ordered.begin() + begin[v + 1]);
  return ordered;
}

}  // namespace

TriangleMesh ProgressiveMesh::triangle_mesh() const {
  TriangleMesh mesh;
  std::vector<VertexId> number(state_.fans.vertex_capacity(), 0);
  mesh.positions.reserve(vertex_count_);
  for (VertexId v = 0; v < number.size(); ++v) {
    if (!state_.fans.contains(v)) continue;
    number[v] = static_cast<VertexId>(mesh.positions.size());
    mesh.positions.push_back(head_->grid.decode(state_.vertices[v].place));
  }
  std::vector<Triangle> triangles = state_.fans.triangles();
  for (Triangle& t : triangles) {
    for (VertexId& v : t) v = number[v];
  }
  mesh.triangles = in_order(triangles, mesh.positions.size());
  return mesh;
}

}  // namespace fanstream
