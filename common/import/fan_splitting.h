// Gives every fan of faces a vertex of its own, once it is settled which faces are joined along which edge.
#pragma once

#include "common/import/face_pairing.h"

namespace fanstream {

struct FanSplitCounts {
  std::uint64_t split_edges = 0;
  std::uint64_t split_vertices = 0;
};

// Appends a copy of a vertex for each further fan around it, so that `mesh`, all of whose vertices must be used,
// becomes an oriented 2-manifold. Where one fan would meet the same neighbour twice, which a fan cannot, it is cut:
// `pairing` is opened along an edge in between.
FanSplitCounts split_fans(TriangleMesh& mesh, FacePairing& pairing);

}  // namespace fanstream
