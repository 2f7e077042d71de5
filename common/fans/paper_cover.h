// The conversion to fans of Suzuki, Okamoto, Kanai, section 3.2.
#pragma once

#include "common/fans/face_owners.h"

namespace fanstream {

// Candidates are taken by ascending id. A candidate without a fan centre around it owns its whole star; otherwise it
// contests the two faces at the edge to each neighbouring centre, and the smaller of the two fans takes both (the new
// one at equal size). The two wing vertices then cease to be candidates, so no three centres are ever mutual
// neighbours. Faces that no centre reached stay free: the isolated triangles. Where a centre loses faces at two places
// its fan falls into several runs; the paper does not say what becomes of them, here each is a fan.
FaceOwners paper_owners(const VertexStars& stars);

}  // namespace fanstream
