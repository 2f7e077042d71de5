// Catmull-Clark by Pixar's OpenSubdiv: the oracle of the tests and the peer of the benchmark.
#pragma once

#include <vector>

#include "client/subdivide/subdivision.h"

namespace fanstream::testing {

// `levels` full steps of the whole mesh: topology by Far::TopologyRefiner, points by Far::PrimvarRefinerReal<double>.
// Precondition: check_polygons.
PolygonMesh refine_with_opensubdiv(const PolygonMesh& mesh, unsigned levels, BoundaryRule rule);

// The same work for the benchmark, without copying the result into a mesh of ours: returns the number of faces.
// `doubles` as above, with four numbers to a point as ours; otherwise with three floats, as it is mostly used.
std::size_t time_opensubdiv(const PolygonMesh& mesh, unsigned levels, bool doubles);

}  // namespace fanstream::testing
