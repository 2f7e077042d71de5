// The tables of Odauchi, Tsukiji, "Real-time local mesh simplification and its application", with ours beside them.
#pragma once

#include <vector>

#include "tests/bench/papers/papers_options.h"

namespace fanstream::bench {

// Drawing and colliding with a model of 4,512 triangles, in full and locally restored; how the time of a collision
// grows with the model; two plots and a picture. Needs armadillo_86k.ply and dragon_stanford_full.ply. A few minutes,
// nearly all of it for building; quick: without the larger sizes.
Result<std::vector<Section>> measure_local_restoration(const PapersOptions& options);

}  // namespace fanstream::bench
