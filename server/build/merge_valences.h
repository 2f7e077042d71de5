// What a merge does to the valences around it, and how far it is put back for that behind others of like cost.
#pragma once

#include <cstdint>

#include "common/fans/ring_mesh.h"
#include "server/build/merged_ring.h"

namespace fanstream {

// Of the parent and the two wings, each of which a merge leaves with one face less.
struct MergeValences {
  // The squares of what their valences are off afterwards, summed: off 6, of a parent on the boundary off 4.
  double irregularity = 0.0;
  // By how many more of them, and of the two ends before, valences are odd afterwards than in the best case, which
  // takes four odd ones away: 0 to 6. On the boundary, where parity means nothing, 1.
  int odd = 0;
};

// Precondition: `ring` has been assigned from `rings` for that merge. A wing counts as one inside the surface.
MergeValences valences_after(const MergedRing& ring, const RingMesh& rings, VertexId root, VertexId removed);

// How much the parity of valences counts in a mesh of so many vertices, 0 to 1: where levels are coarse, and a fan more
// or less is seen, fully; then less with the fourth power, since it costs bits.
double parity_share(std::uint32_t vertices);

// What a merge that costs `own`, and with its coding `cost`, is tried at, `limit` being the cost from which on a
// generation leaves merges out (infinite if it leaves none out). From `cost` to `limit`: valences decide who goes
// first, not who goes. Precondition: 0 <= own <= cost.
//   c = min(cost + 0.05 (1 - parity) own * irregularity, limit)
//   c + (limit - c) x / (1 + x),  x = parity * odd        (c (1 + x) without a limit)
// Regular valences take fewer bits, and their rings fewer steps of a decoder. A closed mesh of even valences only can
// have its vertices coloured with three colours, so that the fans around those of the rarest are a cover: n / 3 fans or
// fewer, and 2 n + 2 n / 3 issued vertices; each pair of odd ones may cost a fan.
double cost_with_valences(double own, double cost, double limit, const MergeValences& valences, double parity);

}  // namespace fanstream
