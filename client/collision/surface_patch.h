// A piece of a mesh as flat arrays, to be gone through fast.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/mesh/triangle_mesh.h"
#include "common/refine/cell_coder.h"

namespace fanstream {

struct SurfacePatch {
  std::vector<double> x, y, z;                          // by vertex
  std::vector<VertexId> numbers;                        // in the mesh
  std::vector<std::uint8_t> is_final;                   // nothing is to be split there any more: as in the full model
  std::vector<std::array<std::uint32_t, 3>> triangles;  // of vertices above
  Bounds box;                                           // of the vertices; kNoBounds where there is none

  std::size_t vertex_count() const { return x.size(); }
  glm::dvec3 position(std::uint32_t v) const { return {x[v], y[v], z[v]}; }
  std::array<glm::dvec3, 3> corners(std::size_t triangle) const {
    const auto& t = triangles[triangle];
    return {position(t[0]), position(t[1]), position(t[2])};
  }
  // Whether the triangle is one of the full model: so if and only if nothing is to be split at its corners.
  bool is_original(std::size_t triangle) const {
    const auto& t = triangles[triangle];
    return (is_final[t[0]] & is_final[t[1]] & is_final[t[2]]) != 0;
  }
  void clear();
  void add_vertex(VertexId number, const glm::dvec3& position, bool final);
};

// All of a mesh, which is taken for the full model.
SurfacePatch patch_of(const TriangleMesh& mesh);

// Makes patches of a mesh that refines and coarsens. Not thread safe.
class PatchMaker {
 public:
  PatchMaker(const FanState& state, const PositionGrid& grid) : state_(state), grid_(grid) {}
  // The triangles of which the cell owns the vertex of the smallest number: so every triangle of the mesh is in the
  // patch of exactly one cell. Takes time proportional to the cell's part of the mesh.
  void make(const CellVertices& cell, SurfacePatch& patch);

 private:
  std::uint32_t local(VertexId v, SurfacePatch& patch);

  const FanState& state_;
  const PositionGrid& grid_;
  std::vector<std::uint32_t> local_;  // by vertex: its number in the patch at hand, from 1, or 0
};

}  // namespace fanstream
