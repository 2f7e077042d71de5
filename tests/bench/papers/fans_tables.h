// Suzuki, Okamoto, Kanai: "LOD based on Progressive Fan Representation": its tables 1 to 4 again, as the paper prints
// them, as its single generation of fans comes out here, and as our generations do.
#pragma once

#include "common/mesh/triangle_mesh.h"
#include "tests/bench/papers/papers_options.h"

namespace fanstream::bench {

// Needs armadillo_86k.ply. Writes fans_ellipsoid.png, fans_711.png and fans_3522.png.
Result<std::vector<Section>> measure_fans(const PapersOptions& options);

}  // namespace fanstream::bench
