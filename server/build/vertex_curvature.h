// Discrete curvature at the vertices of a mesh (Kim, Kim, Kim: "Extended QEM for Surface Simplification Algorithm").
#pragma once

#include <vector>

#include "common/fans/ring_mesh.h"
#include "server/build/cost_options.h"

namespace fanstream {

// By vertex, in 1/length (mean, principal) or 1/length^2 (gaussian), with A the area of the faces around it:
//   mean       H = (1/2 sum e d) / (A/3) over its inner edges: e the length, d the angle between the normals of the
//   edge's two
//              faces, negative where the edge is convex (the source leaves open which sign is which): on a sphere of
//              radius r this is -2/r, as a point inside is at a negative distance from the planes around it
//   gaussian   K = (2 pi - sum phi) / (A/3) with the faces' angles phi at the vertex, at the boundary (pi - sum phi) /
//   (A/3) principal  2 |H| where K >= 0, else 2 sqrt(H^2 - K)
// 0 where the faces have no area. Faces without area count for nothing in d. Always finite. Angles below 0.4 are good
// to 1e-5 of themselves. `rings` are the mesh's. O(vertices).
std::vector<double> vertex_curvature(const TriangleMesh& mesh, const RingMesh& rings, Curvature which);

}  // namespace fanstream
