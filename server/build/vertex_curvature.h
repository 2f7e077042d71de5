// Discrete curvature at the vertices of a mesh (Kim, Kim, Kim: "Extended QEM for Surface Simplification Algorithm").
#pragma once

#include <vector>

#include "common/fans/ring_mesh.h"
#include "server/build/cost_options.h"

namespace fanstream {

// By vertex, in 1/length (mean, principal) or 1/length^2 (gaussian), with A the area of the faces around it:
//   mean       H = (1/2 sum e d) / (A/3) over its inner edges: e the length, d the angle between the normals of the edge's two
//              faces, positive where the edge is convex. (Of each edge half belongs to either end: on a sphere of radius r
//              this H is 3/r, in proportion for all vertices; only that matters.)
//   gaussian   K = (2 pi - sum phi) / (A/3) with the faces' angles phi at the vertex, at the boundary (pi - sum phi) / (A/3)
//   principal  2 |H| where K >= 0, else 2 sqrt(H^2 - K)
// 0 where the faces have no area. Faces without area count for nothing in d. Always finite.
// O(vertices), one pass over the rings.
std::vector<double> vertex_curvature(const RingMesh& rings, const std::vector<glm::dvec3>& places, Curvature which);

}  // namespace fanstream
