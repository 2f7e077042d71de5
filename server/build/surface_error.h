// How far the displayed surface is from the full model while a patch is merged: certified, and tight.
//
// The distance is measured one way, from every point of the full model (with its vertices on the grid) to the displayed
// mesh, with the places that a decoder gives the merged vertices. The result is an upper bound of the largest distance.
//
// Chains. Each triangle T of the full model is cut into up to three convex pieces (Cut), each carried by one face of
// the current mesh, fine to coarse. At first T itself carries all of it. When a patch covers the face that carries a
// piece, the piece is handed to a face of the star that the patch leaves; while no patch does, nothing changes. So a
// point x of T has a chain of faces F_0 = T, F_1, ..., where patch Q_i has made F_i and Q_(i+1) covered it. F_i is in a
// mesh if and only if Q_i is merged and Q_(i+1) is split. A face that Q_i made is part of what the root of Q_i must see
// before it is split, so Q_i is only split after Q_(i+1) (CODING.md, section 9): any legal state of a view-dependent
// mesh has exactly one face of every chain. The distance to one face is a convex function, so its largest value on a
// piece is at one of the piece's corners; that is charged to Q_i. Hence in every legal mesh, however its parts are
// refined, each point of the full model has a face that is no farther off than the error of the merged patch that made
// it.
//
// Pieces. T is cut anew only by a patch that covers the faces of all its pieces. That patch is in the chains of all
// points of T: no legal mesh holds faces from before it for one and from after it for another, so the pieces that a
// legal mesh shows are of one cut and leave no gap. Where three pieces are too few for a tight bound, T is cut into
// parts, smaller triangles that each lie in one piece, which go on as triangles of their own until a patch covers all
// of them; then T is whole again. The same holds for them.
//
// Tightness. A triangle is cut further as long as its bound is more than 3 % and a tenth of a grid step above the
// largest distance that some tracked point in its patch has from the star, or above 0.8 of what points have in other
// patches around: those decide what a whole cell of patches says. (With all of it instead of 0.8 a view takes 2 to 8 %
// more bytes to the same stated error; with none of it no fewer, for a fifth more time.) Measured on bunny, armadillo,
// fandisk, mountain, cow and dragon, the largest bound of a level is 1.0 to 1.3 times the largest sampled distance, but
// for the finest levels of the fandisk (1.6, where that is 3 grid steps).
//
// Rounding. Grid places are exact in floats; distances are to points within a face but for the rounding of a few
// operations, for which a margin is added (StarDistance::kMargin), and one for the corners of parts, which are rounded
// to floats.
//
// Not certified is the other direction, from the displayed mesh to the full model. A cut-off hole or notch of a
// boundary may be farther from the model than any point of the model is from the mesh: up to 1.5 times in coarse
// levels, where measured.
//
// In the spirit of Klein, Liebich and Strasser, "Mesh reduction with error control" (1996), which keeps with each
// removed vertex the face that is nearest to it; here with pieces of triangles, so that the bound holds between
// vertices too.
#pragma once

#include <future>
#include <vector>

#include "server/build/coded_history.h"
#include "server/build/normal_cone.h"
#include "server/build/placed_mesh.h"

namespace fanstream {

// All merges of one root in one generation.
struct PatchSurface {
  float error = 0.0F;  // bound of the distance, in the model's units; not monotone along chains
  NormalCone normals;  // of those triangles of the full model of which the patch carries a piece
};

struct SurfaceErrors {
  std::vector<PatchSurface> patches;
  std::vector<std::uint32_t> patch_of;  // by merge
};

// `coded` was made from the model that `mesh` is. Deterministic: a large model is measured in parts, which are the same
// on every machine, on as many threads as there are processors. O(triangles * generations). About 200 bytes a triangle
// of working memory.
SurfaceErrors measure_surface(const PlacedMesh& mesh, const CodedHistory& coded);

// The same, if there is a second processor for it on a thread of its own, else when the result is asked for. The
// arguments must stay as they are until then, or until the future is gone.
std::future<SurfaceErrors> start_measuring_surface(const PlacedMesh& mesh, const CodedHistory& coded);

}  // namespace fanstream
