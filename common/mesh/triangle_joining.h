// Polygons out of the triangles that they were cut into.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/mesh/triangle_mesh.h"

namespace fanstream {

// Polygons of more corners stay cut into triangles.
inline constexpr std::uint32_t kMostPolygonCorners = 255;

// Faces of any number of corners, counter-clockwise seen from outside.
struct JoinedFaces {
  std::vector<VertexId> corners;                // of all faces, one after another
  std::vector<std::uint32_t> first{0};          // face f has corners [first[f], first[f + 1])
  std::vector<std::uint32_t> face_of_triangle;  // by triangle

  std::uint32_t face_count() const { return static_cast<std::uint32_t>(first.size() - 1); }
  std::span<const VertexId> face(std::uint32_t f) const {
    return std::span(corners).subspan(first[f], first[f + 1] - first[f]);
  }
};

// Bit k of inner[t] says that the edge from corner k of triangle t to the next one is a diagonal of a polygon, to be
// joined across. Both sides have to say so, which settles where they do not. What is joined has to be a disc: its
// triangles a tree, no corner twice, at most kMostPolygonCorners of them; where it is not, its triangles stay alone,
// and their bits are cleared. Faces come in the order of their first triangles, each begins with its least vertex.
// Precondition: `triangles` are oriented alike, every edge has at most two, inner.size() == triangles.size().
// O(n log n) in the joined edges. Never fails, whatever the bits.
JoinedFaces join_triangles(std::span<const Triangle> triangles, std::vector<std::uint8_t>& inner);

// The bits for join_triangles where each triangle's source face is known (ImportedMesh::source_faces): the edges that
// two triangles of one face share. Empty source_faces: no bits.
std::vector<std::uint8_t> inner_edges(std::span<const Triangle> triangles, std::span<const std::uint32_t> source_faces);

}  // namespace fanstream
