// Suzuki, Okamoto, Kanai: "LOD based on Progressive Fan Representation": its tables 1 to 4 again, as the paper prints
// them, as its single generation of fans comes out here, and as our generations do.
#pragma once

#include "common/mesh/triangle_mesh.h"
#include "tests/bench/papers/papers_options.h"

namespace fanstream::bench {

// Needs armadillo_86k.ply. Writes fans_ellipsoid.png, fans_711.png and fans_3522.png.
Result<std::vector<Section>> measure_fans(const PapersOptions& options);

// A number of fans that no cover of the mesh can be below: a fan around v has at most v's faces, so the shares
// 1 / (most faces around a corner) of all faces sum up to no more than one a fan.
std::size_t least_fans(std::size_t vertex_count, const std::vector<Triangle>& triangles);

}  // namespace fanstream::bench
