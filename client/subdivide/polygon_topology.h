// Which half-edges of a polygon mesh face each other. Corner c of the mesh is also the half-edge from that corner to
// the next one of its face.
#pragma once

#include <cstdint>
#include <vector>

#include "common/mesh/polygon_mesh.h"
#include "common/support/result.h"

namespace fanstream {

using CornerId = std::uint32_t;
inline constexpr CornerId kBoundary = ~CornerId{0};

// Per half-edge the opposite one, or kBoundary. Fails as check_polygons (subdivision.h) states, which this implements.
Result<std::vector<CornerId>> half_edge_twins(const PolygonMesh& mesh);

inline CornerId next_corner(CornerId c, std::uint32_t face_begin, std::uint32_t face_end) {
  return c + 1 == face_end ? face_begin : c + 1;
}
inline CornerId previous_corner(CornerId c, std::uint32_t face_begin, std::uint32_t face_end) {
  return (c == face_begin ? face_end : c) - 1;
}

}  // namespace fanstream
