// A mesh of polygons with any numbers of corners, its points in homogeneous coordinates: what subdivision works on.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <span>
#include <vector>

#include "common/mesh/triangle_mesh.h"

namespace fanstream {

using FaceId = std::uint32_t;
inline constexpr FaceId kNoFace = ~FaceId{0};

// The vertex at (x, y, z) / w is held as (x, y, z, w), w > 0: a point p of weight w as (w p, w). All rules of
// subdivision are affine and work on the four numbers alike; who needs a place in space divides (position). Plain
// meshes have w = 1 everywhere, and so have all that is refined from them.
struct PolygonMesh {
  std::vector<glm::dvec4> points;
  std::vector<VertexId> corners;                  // of all faces, one after another, counter-clockwise from outside
  std::vector<std::uint32_t> face_begins = {0U};  // face f has corners [face_begins[f], face_begins[f + 1])

  std::size_t face_count() const { return face_begins.size() - 1; }
  std::span<const VertexId> face(FaceId f) const {
    return std::span<const VertexId>(corners).subspan(face_begins[f], face_begins[f + 1] - face_begins[f]);
  }
  void add_face(std::span<const VertexId> face_corners) {
    corners.insert(corners.end(), face_corners.begin(), face_corners.end());
    face_begins.push_back(static_cast<std::uint32_t>(corners.size()));
  }
};

inline glm::dvec3 position(const glm::dvec4& point) { return glm::dvec3(point) / point.w; }
std::vector<glm::dvec3> positions(std::span<const glm::dvec4> points);

// The triangles as faces of three corners, weights 1, vertices and faces in their order.
PolygonMesh polygon_mesh(const TriangleMesh& mesh);

// The triangles of all faces, vertices and faces in their order: a face of n corners gives n - 2. Quads are cut along
// the diagonal that folds least, larger faces as polygon_triangulation.h states. `face_of_triangle` may be given.
TriangleMesh triangle_mesh(const PolygonMesh& mesh, std::vector<FaceId>* face_of_triangle = nullptr);

}  // namespace fanstream
