// An indexed triangle mesh in the model's own coordinates: what import yields and simplification starts from.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

namespace fanstream {

using VertexId = std::uint32_t;
using Triangle = std::array<VertexId, 3>;  // counter-clockwise seen from outside

// After MeshCleaner (common/import) the mesh is an oriented 2-manifold with boundary, possibly of several components:
// every edge has one or two faces, the faces around every vertex form one fan, every vertex is used.
struct TriangleMesh {
  std::vector<glm::dvec3> positions;
  std::vector<Triangle> triangles;
};

// The axis-aligned box of all positions; {0,0} for an empty mesh.
struct Bounds {
  glm::dvec3 low{0.0};
  glm::dvec3 high{0.0};
  double diagonal() const;
};
Bounds bounds_of(const std::vector<glm::dvec3>& positions);

// Of a face, in the square of the model's unit.
double area_of(const TriangleMesh& mesh, const Triangle& face);

// Connected components by shared vertices.
std::size_t count_components(std::size_t vertex_count, const std::vector<Triangle>& triangles);

}  // namespace fanstream
