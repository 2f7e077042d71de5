// The two halves of the cover that minimises issued vertices: a greedy start and a local search.
#pragma once

#include "common/fans/face_owners.h"

namespace fanstream {

// Repeatedly gives all free faces around the vertex that has most of them to that vertex.
FaceOwners greedy_owners(const VertexStars& stars);

// Re-decides the star of every vertex, `sweeps` times over: given the owners of all other faces, a dynamic programme
// along the star finds owners of its faces that leave the fewest fans. The number of fans never grows. Equal choices
// are made by a generator of fixed seed, so the search wanders along plateaus and yet the result depends on the mesh
// alone. Time is linear in faces times sweeps.
void improve_owners(const VertexStars& stars, int sweeps, FaceOwners& owners);

}  // namespace fanstream
