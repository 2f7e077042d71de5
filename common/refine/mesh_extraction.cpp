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

// Cells make their vertices with rising numbers, which are above those of all coarser slabs.
std::vector<VertexId> ProgressiveMesh::vertices_in_order() const {
  std::vector<VertexId> order(head_->base.places.size());
  order.reserve(vertex_count_);
  for (VertexId v = 0; v < order.size(); ++v) order[v] = v;
  for (const CellProgress& cell : cells_) {
    for (std::uint32_t i = 0; cell.live && i < cell.live->vertices.made; ++i)
      order.push_back(cell.live->vertices.made_at(i));
  }
  return order;
}

std::vector<VertexId> ProgressiveMesh::asset_numbers() const {
  std::vector<VertexId> numbers(state_.vertex_end(), 0);
  for (VertexId v = 0; v < head_->base.places.size(); ++v) numbers[v] = v;
  for (const CellProgress& cell : cells_) {
    for (std::uint32_t i = 0; cell.live && i < cell.live->vertices.made; ++i)
      numbers[cell.live->vertices.made_at(i)] = cell.live->vertices.first_new + i;
  }
  return numbers;
}

TriangleMesh ProgressiveMesh::triangle_mesh() const {
  TriangleMesh mesh;
  mesh.positions.reserve(vertex_count_);
  std::vector<VertexId> number(state_.vertex_end(), 0);
  for (const VertexId v : vertices_in_order()) {
    number[v] = static_cast<VertexId>(mesh.positions.size());
    mesh.positions.push_back(head_->grid.decode(state_.vertices[v].place));
  }
  std::vector<Triangle> triangles = state_.fans.triangles(state_.vertex_end());
  for (Triangle& t : triangles) {
    for (VertexId& v : t) v = number[v];
  }
  mesh.triangles = in_order(triangles, mesh.positions.size());
  return mesh;
}

}  // namespace fanstream
