// Small meshes of polygons for tests. Deterministic; oriented 2-manifolds, outward facing, every vertex used.
#pragma once

#include <cstdint>

#include "common/mesh/polygon_mesh.h"
#include "common/mesh/triangle_mesh.h"

namespace fanstream::testing {

PolygonMesh make_cube();                                      // 6 quads, from -1 to 1
PolygonMesh make_quad_torus(unsigned rings, unsigned sides);  // rings * sides quads; each at least 3
PolygonMesh make_quad_grid(unsigned columns, unsigned rows);  // flat, in the xy plane
// A polygon per vertex of a closed triangle mesh, a vertex per triangle: faces of any size, valence 3.
PolygonMesh dual_of(const TriangleMesh& closed);
// Adjacent faces united at random along about a `share` of the edges. No face meets itself or another one twice in a
// row, no vertex loses its third edge (on the boundary: its second).
PolygonMesh with_dissolved_edges(const PolygonMesh& mesh, double share, std::uint64_t seed);
// Every point moved by up to `amount` along each axis.
PolygonMesh jittered(PolygonMesh mesh, double amount, std::uint64_t seed);
// Weights from 0.5 to 2, at random, the places unchanged.
PolygonMesh with_random_weights(PolygonMesh mesh, std::uint64_t seed);

}  // namespace fanstream::testing
