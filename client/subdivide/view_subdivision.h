// View-dependent sqrt(2)-subdivision (Miura, Adachi, Ikedo, section 4): faces in the view volume that face the eye are
// refined to one depth, faces at the silhouette deeper, each only until it is small enough on the screen.
//
//   corner normal  of a corner: of the plane through it and its two neighbours, on the side of the face's mean normal;
//                  the bare cross product is on the other side at reflex corners. An n-gon has n, and may face the eye
//                  with some and away with others: it counts as front and as back face.
//   silhouette     vertices at the ends of an edge where a front face meets a back face, or where the surface ends, and
//                  all faces with such a vertex, hidden ones included.
//   done           a face all of whose edges are at most `size_px` long on the screen, or that would move by
//                  less than `tolerance_px` if it were refined forever (an estimate, see SUBDIVISION.md).
//
// Sets are chosen anew at each depth among the children of what was refined. Every call starts from the initial mesh.
#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "client/subdivide/adaptive_subdivision.h"
#include "client/view/criteria.h"

namespace fanstream {

struct ViewSubdivisionOptions {
  unsigned front_depth = 4;       // half-steps, at most kMaxViewDepth
  unsigned silhouette_depth = 8;  // likewise
  double size_px = 1.0;           // 0: size does not count
  double tolerance_px = 0.0;      // 0: flatness does not count
  // Rings of faces refined around those with a silhouette vertex. The silhouette moves as the faces get finer: with 0,
  // as in the source, up to a tenth of it ends a half-step or two short of its depth, which is hardly seen; with 1, for
  // 20 to 35 % more faces, hardly any does.
  unsigned silhouette_rings = 0;
  SubdivisionOptions subdivision;
  // Asked between half-steps with their number; true stops with `interrupted`. May be empty.
  std::function<bool(unsigned depth)> stop;
};
inline constexpr unsigned kMaxViewDepth = 24;

struct ViewSubdivision {
  AdaptiveMesh refined;
  // Faces of the initial mesh in the view volume that face the eye, and that belong to the silhouette; some do both.
  std::size_t front_faces = 0;
  std::size_t silhouette_faces = 0;
};

// `eligible` has a value per face of the mesh, or is empty: only faces with one that is not 0 may be refined (their
// vertices move all the same, where they share them with refined faces). Fails as check_polygons, check_view,
// (usage) for depths beyond the limit or a mask of another size, (limit) as AdaptiveSubdivision::refine, (interrupted).
Result<ViewSubdivision> subdivide_for_view(const PolygonMesh& mesh, const View& view,
                                           const ViewSubdivisionOptions& options = {},
                                           std::span<const std::uint8_t> eligible = {});

}  // namespace fanstream
