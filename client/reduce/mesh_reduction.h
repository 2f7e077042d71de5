// Levels of detail made on the device: a mesh reduced by edge merges to chosen numbers of triangles.
//
// After fuziki, "An algorithm for polygon reduction" (Qiita, 2017): an edge costs the squared distances of the vertex
// that replaces it to the planes around its two ends (Garland and Heckbert, "Surface simplification using quadric error
// metrics", 1997); that vertex stays on the edge, so that texture coordinates and colours follow by interpolation.
// REDUCTION.md has the formulas, the rules at boundaries and seams, and what was measured.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "common/mesh/triangle_mesh.h"
#include "common/mesh/vertex_attributes.h"
#include "common/support/result.h"

namespace fanstream {

enum class PlaneWeight {
  one,   // every plane counts alike, as the source has it
  area,  // by the area of its triangle
};

struct ReductionOptions {
  PlaneWeight weight = PlaneWeight::area;
  // Besides the planes of the faces that are around an edge now, which the source counts, those of all faces that were
  // there before count this many times their own weight; 0 is the source's rule. Without memory thin parts vanish at
  // strong reduction: no plane around a limb is against making it shorter.
  double past_share = 0.3;
  // Boundaries and seams of attributes are held by planes upright on their faces, which weigh this many times as much.
  double border_weight = 2.0;
  // A merge that would turn a face by more than this angle's cosine is refused.
  double least_normal_cosine = 0.2;
  // A merge that would leave more faces around a vertex is refused, unless there were more before.
  std::uint32_t longest_ring = 64;
  // Called some hundred times with how much is done, in [0, 1]; false ends the reduction (interrupted). May be empty.
  std::function<bool(double fraction)> go_on;
};

struct ReducedLevel {
  std::size_t asked_triangles = 0;
  TriangleMesh mesh;            // an oriented manifold; every vertex is used
  CornerAttributes attributes;  // of it; empty where the source had none
  std::string shortfall;        // why there are more triangles than were asked for; empty where there are not

  bool reached() const { return shortfall.empty(); }
};

// Fails where what it was given cannot be kept; its error ends the reduction.
using LevelSink = std::function<Result<void>(ReducedLevel&&)>;

// Merges the cheapest edge, again and again, and gives the mesh away whenever it has come down to one of the counts: to
// exactly so many triangles, or one less where the last merge took two. A count that the mesh does not exceed gives it
// as it is. Where no edge is left that may be merged, that count and all further ones get what there is, with the
// reason.
//
// Topology, the number of components and of boundaries are kept; so is every vertex that is not merged, to the last
// bit. Boundary vertices stay on the boundary. Positions are shared across seams, so no crack opens; along a seam both
// sides are merged together, and a vertex where more than two wedges meet stays where it is.
//
// Deterministic: the same mesh, numbered alike, gives the same levels. About 0.2 kB of working memory a triangle. One
// thread; any number of calls side by side. Errors: usage (no counts, or they do not fall), bad_input (not an oriented
// manifold, a position or attribute that is not finite, attributes that do not fit the mesh), limit (more than 2^30
// triangles), interrupted (go_on), and what the sink says.
Result<void> reduce_mesh(const TriangleMesh& mesh, const CornerAttributes& attributes,
                         std::span<const std::size_t> triangle_counts, const ReductionOptions& options,
                         const LevelSink& sink);

// One vertex for each (vertex, wedge) pair that is used, as files want it: positions repeat along seams.
struct VertexAttributedMesh {
  TriangleMesh mesh;
  VertexAttributes attributes;
};
VertexAttributedMesh split_at_seams(const TriangleMesh& mesh, const CornerAttributes& attributes);

}  // namespace fanstream
