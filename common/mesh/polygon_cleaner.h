// Turns whatever polygons a file holds into an oriented 2-manifold with boundary, which subdivision needs.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "common/mesh/polygon_mesh.h"

namespace fanstream {

// What clean_polygons() changed.
struct PolygonRepairs {
  std::uint64_t welded_vertices = 0;        // merged into an earlier one with the very same four numbers
  std::uint64_t unreferenced_vertices = 0;  // dropped
  std::uint64_t repeated_corners = 0;       // corners dropped because the next one is the same vertex
  std::uint64_t cut_faces = 0;         // faces that met a vertex twice and became one face per loop between its visits
  std::uint64_t degenerate_faces = 0;  // dropped: fewer than three corners, of the file or after the two above
  std::uint64_t duplicate_faces = 0;   // dropped: an earlier face has the same corners, in any order
  std::uint64_t flipped_faces = 0;     // reversed to agree with the rest of their component
  std::uint64_t opened_edges = 0;      // of more than two faces, or of two that cannot agree: boundary of each now
  std::uint64_t split_vertices = 0;    // copies, one for each further fan of faces around a vertex

  bool operator==(const PolygonRepairs&) const = default;
};
std::vector<std::pair<std::string, std::uint64_t>> named_counts(const PolygonRepairs& repairs);

// The result satisfies check_polygons (client/subdivide) and has no unused vertices; faces keep their order. Nothing is
// welded by distance; faces with collinear corners or without area stay. Windings agree within each component, as most
// of its faces had them. The two sides of an opened edge stay together under subdivision, because the boundary curve
// depends on the boundary alone, but for where such edges meet or end.
// Deterministic; O(n log n). Precondition: corners in range, points finite.
PolygonRepairs clean_polygons(PolygonMesh& mesh);

}  // namespace fanstream
