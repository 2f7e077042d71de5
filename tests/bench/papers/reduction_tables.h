// The part of the papers bench on reduction on the device: fuziki, "An algorithm for polygon reduction".
#pragma once

#include <vector>

#include "tests/bench/papers/papers_options.h"

namespace fanstream::bench {

// Levels of about 4000, 2000, 1000 and 200 triangles, as the source shows them, of several models: counts reached,
// distance from the model, time of one pass, beside meshoptimizer's simplifier; and the source's own rule beside ours.
// Writes reduction.png (the bunny) and reduction_textured.png (a model with texture coordinates).
Result<std::vector<Section>> measure_reduction(const PapersOptions& options);

}  // namespace fanstream::bench
