// Which faces stay joined along which edge, and which way round each face is, so that all joined faces agree.
#pragma once

#include <cstdint>
#include <vector>

#include "common/mesh/triangle_mesh.h"

namespace fanstream {

// Half-edge 3 t + k runs from corner k of triangle t to its next corner; corner and half-edge share their number.
using HalfEdge = std::uint32_t;
inline constexpr HalfEdge kNoHalfEdge = ~HalfEdge{0};
inline HalfEdge next_in_triangle(HalfEdge h) { return h % 3 == 2 ? h - 2 : h + 1; }
inline HalfEdge previous_in_triangle(HalfEdge h) { return h % 3 == 0 ? h + 2 : h - 1; }

struct FacePairing {
  std::vector<HalfEdge> opposite;         // per half-edge: the half-edge it is joined with, or kNoHalfEdge
  std::uint64_t flipped_triangles = 0;    // reversed in place
  std::uint64_t duplicate_triangles = 0;  // removed in place
  bool has_split_edges = false;           // an edge between some two vertices is left with more than one instance
};

// Removes duplicate triangles, reverses triangles in place and pairs their half-edges as mesh_cleaner.h states.
// Afterwards opposite[opposite[h]] == h, and two joined half-edges run between the same two vertices in opposite
// directions. What is kept by triangle in `by_triangle` (unless that is empty or null) goes along with its triangle.
// Precondition: no triangle repeats a corner.
FacePairing pair_faces(TriangleMesh& mesh, std::vector<std::uint32_t>* by_triangle = nullptr);

}  // namespace fanstream
