// The parts of the cover that minimises issued vertices: a greedy start and two local searches.
#pragma once

#include <cstddef>

#include "common/fans/face_owners.h"

namespace fanstream {

// Repeatedly gives all free faces around the vertex that has most of them to that vertex.
FaceOwners greedy_owners(const VertexStars& stars);

// Re-decides the star of every vertex, `sweeps` times over: given the owners of all other faces, a dynamic programme
// along the star finds owners of its faces that leave the fewest fans. The number of fans never grows. Equal choices
// are made by a generator of fixed seed, so the search wanders along plateaus and yet the result depends on the mesh
// alone. Time is linear in faces times sweeps.
void improve_owners(const VertexStars& stars, int sweeps, FaceOwners& owners);

struct CenterSearchEffort {
  std::size_t steps =
      0;           // of one try; each lets one centre go and takes one in: about 0.2 us, whatever the mesh's size
  int sweeps = 0;  // of improve_owners after a try, at most
  int tries = 1;   // at most
};

// Every face has a fan's centre among its corners, so no cover has fewer fans than the fewest vertices that reach all
// faces; and nearly always so many do, since those vertices are rarely neighbours. Seeks such vertices, from the
// present owners on, shares the faces out among them and improves that, and tries again with others while there are
// more fans than centres. The present owners stay where it comes out no better. By a generator of fixed seed.
// Precondition: every face is owned.
void search_centers(const VertexStars& stars, const CenterSearchEffort& effort, FaceOwners& owners);

}  // namespace fanstream
