// Generations by error: the merges that a coarse view goes without, apart from those that it needs.
#pragma once

#include "server/build/coded_history.h"
#include "server/build/placed_mesh.h"

namespace fanstream {

struct LevelOptions {
  // The share of the patches, by rising error, that stay in as few generations as their order allows.
  double fine_share = 0.95;
  // Of the errors of generations that follow each other, above those.
  double ratio = 1.7;
};

// The same merges in generations by error. The simplifier's generations are made of what can be merged side by side,
// the cheap and the dear, so that a view needs nearly all of one for its few worst patches. Here a patch (the merges of
// one root in one generation) gets its generation by what it is off, and by what may not be undone before it:
//
// Of two patches of which the second, a coarser one, covers a face that the first has left, the second has to be split
// first. With error(P) how far vertices of the full model are from the star that P leaves, reach(P) = max(error(P),
// reach of all that have to wait for P) and e the fine_share quantile of all reaches,
//     level(P) = max(1 + level of all that have to wait for P, reach(P) > e ? d + floor(log(reach(P) / e) / log(ratio))
//     : 0)
// where d is above the levels of 95 % of the patches with a reach of at most e. Patches of one level share no face, or
// one of them would wait for the other, so the levels are generations. Where they are more than kMostGenerations, the
// ratio is raised until they are not.
//
// Errors are those of the vertices alone, unsigned and not certified: only the order depends on them. `coded` was made
// from the model that `mesh` is. Deterministic; O(triangles * generations), a third of the time of measure_surface, on
// as many threads as there are processors. Precondition: 0 <= fine_share <= 1, ratio > 1.
MergeHistory level_by_error(const PlacedMesh& mesh, const CodedHistory& coded, const LevelOptions& options);

}  // namespace fanstream
