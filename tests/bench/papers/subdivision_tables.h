// sqrt(2)-subdivision (Miura, Adachi, Ikedo): what refinement for a view saves, and how fast refinement is.
#pragma once

#include "tests/bench/papers/papers_options.h"

namespace fanstream::bench {

// Speed against OpenSubdiv at about a million faces, in turns on one thread; faces of adaptive and of uniform
// refinement at the same error of the outline; pictures subdivision-<model>.png: the cage, and the refined mesh from
// the front and obliquely. Fails naming the mesh that is missing or bad, or the file that cannot be written.
Result<std::vector<Section>> measure_subdivision(const PapersOptions& options);

}  // namespace fanstream::bench
