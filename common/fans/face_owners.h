// A fan cover as it is searched for: every face is owned by one of its three vertices, and each unbroken run of the
// faces that a vertex owns in its star is a fan of that centre.
#pragma once

#include <vector>

#include "common/fans/fan_mesh.h"
#include "common/fans/vertex_stars.h"

namespace fanstream {

// owner[face] is one of the face's vertices, or kNone while it is free.
using FaceOwners = std::vector<VertexId>;

// The fans by ascending centre, then one fan of one triangle for each free face, its centre the smallest id. A closed
// ring starts at its smallest id, an open one at its first vertex counter-clockwise. `vertices` stays empty.
FanMesh fans_of(const VertexStars& stars, const FaceOwners& owners);

// How many those are.
std::size_t fan_count(const VertexStars& stars, const FaceOwners& owners);

}  // namespace fanstream
