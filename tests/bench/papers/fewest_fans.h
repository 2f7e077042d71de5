// How few fans the cover of a mesh can have at all: bounds that a cover is measured by.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "common/mesh/triangle_mesh.h"

namespace fanstream::bench {

// A number of fans that no cover of the mesh can be below: a fan around v has at most v's faces, so the shares
// 1 / (most faces around a corner) of all faces sum up to no more than one a fan.
std::size_t least_fans(std::size_t vertex_count, const std::vector<Triangle>& triangles);

// The fewest vertices that every face has one of. Each fan's centre is one, so no cover has fewer fans; it is the
// tightest bound that does not ask whether a centre's faces lie side by side. Exact: by dynamic programming over the
// vertices in an order that keeps those with neighbours still to come few. Nothing where more than `widest` of these
// would come together. Time and memory grow as 2^widest (22: a second or less, 20 MB), and linearly with the mesh.
std::optional<std::size_t> fewest_centers(std::size_t vertex_count, const std::vector<Triangle>& triangles,
                                          std::size_t widest = 22);

}  // namespace fanstream::bench
