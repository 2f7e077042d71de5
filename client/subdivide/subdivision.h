// sqrt(2)-subdivision, uniform: Catmull-Clark in two half-steps.
// Miura, Adachi, Ikedo, "sqrt(2)-Subdivision: Adaptive Refinement by Two-Stepped Catmull-Clark Subdivision".
// SUBDIVISION.md beside this header states the rules, those at boundaries included.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/mesh/polygon_mesh.h"
#include "common/support/result.h"

namespace fanstream {

// How the boundary of an open mesh is refined, where an edge has one face. Both make cubic B-spline curves of it.
enum class BoundaryRule : std::uint8_t {
  smooth,   // all boundary vertices lie on the curve (OpenSubdiv: VTX_BOUNDARY_EDGE_ONLY)
  corners,  // a vertex with a single face stays where it is: a corner (OpenSubdiv: VTX_BOUNDARY_EDGE_AND_CORNER)
};

// Faces are joined by numbers of 32 bits. A result of so many corners takes about 5 GB while it is refined uniformly,
// 11 GB adaptively.
inline constexpr std::size_t kMaxCorners = std::size_t{1} << 28;

struct SubdivisionOptions {
  BoundaryRule boundary = BoundaryRule::corners;
  // Of any mesh on the way, at most kMaxCorners. What would exceed it is refused before memory is taken for it.
  std::size_t max_corners = kMaxCorners;
};

// Whether a mesh can be subdivided: faces of three corners or more, in range, none repeated within a face; finite
// points of weight > 0; an oriented 2-manifold with boundary, as is_oriented_manifold() says of triangles, but that
// vertices may be unused. Collinear corners, faces without area and vertices at the same place are fine: the rules
// only take means. Fails (bad_input) naming the first offence and its face or vertex; clean_polygons() mends faces and
// topology. (limit) beyond kMaxCorners. Linear time. Safe on untrusted input.
Result<void> check_polygons(const PolygonMesh& mesh);

// Faces of the mesh after so many half-steps, exactly; for an odd depth the quads of the edges and the triangles of the
// boundary edges. Saturates. Precondition: check_polygons.
std::size_t uniform_face_count(const PolygonMesh& mesh, unsigned depth);

// All faces refined by `depth` half-steps; 0 gives the mesh itself. Even depths 2 m are m steps of Catmull-Clark. The
// first points are those of the mesh, moved; then come the face points and the edge points of each full step.
// Face 4 h + k of a later full step lies in corner k of face h (corner c of the mesh for the first step): the corner's
// vertex comes first, then counter-clockwise edge, face and edge point.
//
// Fails as check_polygons, and (limit) where the result would exceed max_corners, before taking memory for it. One
// thread, no state; deterministic: the same bits in every build. Memory: about 55 bytes per face of the result and 65
// per face of the level before.
Result<PolygonMesh> subdivide(const PolygonMesh& mesh, unsigned depth, const SubdivisionOptions& options = {});

}  // namespace fanstream
