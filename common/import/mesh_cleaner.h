// Turns whatever triangles a file holds into an oriented 2-manifold with boundary that draws the same picture.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "common/mesh/triangle_mesh.h"

namespace fanstream {

// What clean_mesh() changed. Input vertices + split_vertices = output vertices + welded_vertices +
// unreferenced_vertices; input triangles = output triangles + degenerate_triangles + duplicate_triangles.
struct RepairReport {
  std::uint64_t welded_vertices = 0;        // merged into an earlier vertex at the very same position
  std::uint64_t unreferenced_vertices = 0;  // dropped: used by no triangle that was kept
  std::uint64_t degenerate_triangles = 0;   // dropped: two corners at the same position, so nothing would be drawn
  std::uint64_t duplicate_triangles = 0;    // dropped: an earlier triangle has the same three corners, in any order
  std::uint64_t flipped_triangles = 0;      // winding reversed to agree with the rest of their component
  std::uint64_t split_edges = 0;     // edges of the welded mesh that occur more than once in the result: more than two
                                     // faces, faces that cannot agree in winding, or opened to keep a vertex manifold
  std::uint64_t split_vertices = 0;  // vertices added: copies, one for each further fan of faces around a vertex

  bool operator==(const RepairReport&) const = default;
};

// The counts with the names under which `build --json` prints them in repairs{}, in the order above.
std::vector<std::pair<std::string, std::uint64_t>> named_counts(const RepairReport& report);

struct CleanedMesh {
  TriangleMesh mesh;
  RepairReport report;
  // By triangle of `mesh`, as they were given; empty if none were. A polygon of which triangles were dropped, or two
  // of whose triangles came apart along an edge that they shared, is no longer whole: what to make of such a face is
  // up to who joins triangles (polygon_faces.h).
  std::vector<std::uint32_t> source_faces = {};
};

// The result satisfies is_oriented_manifold(); it may be empty and may have any number of components. The drawn
// triangles are those of the input, minus degenerate and duplicate ones. A triangle without area whose three corners
// lie at different positions is kept: it closes gaps, and an edge with a face less would be a crack.
//
// - Positions are equal when bit-identical (-0 equals +0). Nothing is welded by distance.
// - Windings agree within each component, as most of its faces had it in the input.
// - At an edge of more than two faces, faces stay joined in pairs: first pairs whose windings agree, flattest first (of
//   equally flat ones the convex pair, so that solids which touch along an edge come apart as solids), then pairs that
//   agree once one side is flipped. What is left over becomes boundary.
//
// Deterministic. Linear time but for sorting around non-manifold edges; about 60 bytes per triangle of working memory.
// Precondition: every index is in range, positions are finite, at most kMaxTriangles and kMaxVertices, all of which
// import_mesh() has checked; `source_faces` (ImportedMesh's) is empty or has one number for each triangle.
CleanedMesh clean_mesh(TriangleMesh mesh, std::vector<std::uint32_t> source_faces = {});

}  // namespace fanstream
