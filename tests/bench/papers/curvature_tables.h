// The tables of Kim, Kim, Kim: "Extended QEM for Surface Simplification Algorithm", with ours beside them.
#pragma once

#include <vector>

#include "tests/bench/papers/papers_options.h"

namespace fanstream::bench {

// Time of the quadric and of each curvature (interleaved runs, the least of several, CPU time of one thread), and the
// distance from the original along the way, both ways as Metro measures it: the cow, 5,804 triangles to 120; the large
// dragon, first reduced to about 50,000 triangles by the quadric, then as far towards 500 as its handles allow; and the
// armadillo, reduced to 50,000 likewise, to 500, since that has none. Writes curvature-<model>.png: RMS error against
// triangles. Errors name the file.
Result<std::vector<Section>> measure_curvature(const PapersOptions& options);

}  // namespace fanstream::bench
