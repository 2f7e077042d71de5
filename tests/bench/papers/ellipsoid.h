// Ellipsoids with 402 vertices, as the first source document measures one (it does not say which mesh it took).
#pragma once

#include "common/mesh/triangle_mesh.h"

namespace fanstream::bench {

// Half axes 1, 0.8 and 0.6; closed, outward facing, 402 vertices and 800 triangles.

// By latitude and longitude: 20 rings of 20 vertices between two poles. The rings' vertices have six neighbours (five
// beside the poles).
TriangleMesh make_ring_ellipsoid();
// An octahedron with each edge in ten parts: six vertices have four neighbours, all others six.
TriangleMesh make_octahedral_ellipsoid();

}  // namespace fanstream::bench
