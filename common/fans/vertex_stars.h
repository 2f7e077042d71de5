// The faces around every vertex of an oriented 2-manifold with boundary, in order.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/mesh/triangle_mesh.h"
#include "common/support/result.h"

namespace fanstream {

// A corner is one vertex of one face: 3 * face + position in the triangle.
using CornerId = std::uint32_t;
using FaceId = std::uint32_t;
inline constexpr std::uint32_t kNone = 0xFFFFFFFFU;

inline FaceId face_of(CornerId corner) { return corner / 3; }
inline CornerId next_corner(CornerId corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }
inline CornerId previous_corner(CornerId corner) { return corner % 3 == 0 ? corner + 2 : corner - 1; }

// Refers to the triangles it was built from, which must outlive it unchanged. Immutable, so safe to share.
class VertexStars {
 public:
  // Fails (bad_input, naming the face or vertex) where an index is out of range, a face repeats a vertex, two faces run
  // the same way along an edge, or the faces around a vertex are not one fan. Vertices without faces are allowed.
  // Limit: a third of 2^32 faces. Time and memory are linear in vertices and faces.
  static Result<VertexStars> build(std::size_t vertex_count, std::span<const Triangle> triangles);

  std::size_t vertex_count() const { return first_.size() - 1; }
  std::size_t face_count() const { return triangles_.size(); }
  std::span<const Triangle> triangles() const { return triangles_; }
  VertexId vertex(CornerId corner) const { return triangles_[corner / 3][corner % 3]; }

  // The corners at the vertex, counter-clockwise; corner i and i+1 belong to faces that share an edge. An open star
  // (of a boundary vertex) starts at the boundary edge that leaves the vertex.
  std::span<const CornerId> star(VertexId vertex) const {
    return std::span<const CornerId>(corners_).subspan(first_[vertex], first_[vertex + 1] - first_[vertex]);
  }
  // Whether the star goes all the way around.
  bool closed(VertexId vertex) const { return closed_[vertex] != 0; }

  // The face on the other side of the edge opposite to the corner, or kNone on the boundary.
  FaceId face_across(CornerId corner) const { return across_[corner]; }

 private:
  Result<void> count_corners(std::size_t vertex_count);
  Result<void> order_star(VertexId vertex, std::vector<CornerId>& corner_leaving, std::vector<CornerId>& ordered);

  std::span<const Triangle> triangles_;
  std::vector<std::uint32_t> first_;  // vertex_count + 1
  std::vector<CornerId> corners_;
  std::vector<FaceId> across_;
  std::vector<std::uint8_t> closed_;
};

}  // namespace fanstream
