// How far the displayed surface is from the full model while a patch is merged: certified, and tight.
//
// The distance is measured one way, from every point of the full model (its vertices on the grid) to the displayed
// mesh, with the places that a decoder gives the merged vertices. The result is an upper bound of the largest distance.
//
// **Chains.** Each triangle T of the full model is cut into three pieces, one for each corner, and each piece is
// carried by one face of the current mesh, fine to coarse. At first that face is T itself. When a patch covers it, the
// piece is handed to a face of the star that the patch leaves; between patches it stays. So a piece has a chain of
// faces F_0, F_1, ..., where F_i is in the mesh if and only if patch Q_i, which made it, is merged and Q_(i+1), which
// covered it, has been split. Q_i can only be split after Q_(i+1) (CODING.md, section 9), so any legal state of a
// view-dependent mesh holds exactly one face of every chain. A piece is convex, and so is the distance to one face: its
// largest value on the piece is at one of the piece's corners. The largest of these is charged to Q_i. Hence in every
// legal mesh each point of the full model is no farther from the mesh than the largest error of the merged patches.
//
// **Pieces.** The pieces of T's corners i, j, k meet in a crossing point on each edge and in one point inside. Corners
// with the same face are one piece. A crossing point may be chosen anew only in a patch that covers both ends of its
// edge, the point inside only in one that covers all three corners. A common patch is in both chains, so no legal mesh
// holds faces of one from before and of the other from after: the pieces of any legal mesh fit together without gaps.
// Where two corners share a face, the point inside lies on the line between the other two crossing points ("strip"),
// and may move on it as long as only those two corners tell the difference.
//
// **What is not certified**: the other direction, from the displayed mesh to the full model.
//
// After the one-sided tests of Klein, Liebich, Strasser, "Mesh reduction with error control", 1996, which keep for each
// removed vertex the face it belongs to; here for pieces of triangles, so that the bound holds between vertices too.
#pragma once

#include <future>
#include <glm/vec3.hpp>
#include <vector>

#include "common/grid/position_grid.h"
#include "server/build/coded_history.h"

namespace fanstream {

// Holds the unit vectors n with dot(n, axis) >= cosine; a cosine of -1 means all of them.
struct NormalCone {
  glm::vec3 axis{0.0F, 0.0F, 1.0F};
  float cosine = -1.0F;
};

// All merges of one root in one generation.
struct PatchSurface {
  float error = 0.0F;  // bound of the distance, in the model's units; not monotone along chains
  NormalCone normals;  // of those triangles of the full model of which the patch carries a piece
};

struct SurfaceErrors {
  std::vector<PatchSurface> patches;
  std::vector<std::uint32_t> patch_of;  // by merge
};

// `places` are the codes of the model's vertices, `triangles` its faces, from which `coded` was made. Deterministic;
// O(triangles * generations). About 140 bytes a triangle of working memory.
SurfaceErrors measure_surface(const std::vector<Triangle>& triangles, std::vector<GridPoint> places,
                              const PositionGrid& grid, const CodedHistory& coded);

// The same, if there is a second processor for it on a thread of its own, else when the result is asked for. The
// arguments must stay as they are until then, or until the future is gone.
std::future<SurfaceErrors> start_measuring_surface(const std::vector<Triangle>& triangles,
                                                   std::vector<GridPoint> places, const PositionGrid& grid,
                                                   const CodedHistory& coded);

}  // namespace fanstream
