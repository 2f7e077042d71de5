// How exactly vertices are to be known at each generation: as the levels' own distances from the model deserve.
#pragma once

#include <vector>

#include "common/coding/place_precision.h"
#include "common/mesh/triangle_mesh.h"
#include "server/build/simplifier.h"

namespace fanstream {

struct LevelDistance {
  std::uint32_t vertices = 0;  // of the level
  double rms = 0.0;            // of the model's vertices from it, in the model's units
};

// Of some levels of a history, each of about half the vertices of the one before, the finest of a quarter of the
// model's (and at most 50,000), the last FM0. From a sample of 4000 vertices: good to some per cent. Parents lie where
// the history says. O(sample log(vertices) + vertices).
std::vector<LevelDistance> measure_level_distances(const TriangleMesh& mesh, const MergeHistory& history);

// As many bits left out by each generation as make its places off by at most `noise` times as far as its level is off
// the model (squares; on each axis, rms). Since a face is off by less than its corners, the noise adds about a
// quarter of this to the distance; a bit of each axis is about an eighth of what a vertex costs. Nothing is left out from
// the generation on where two fifths of the vertices are never split again: these are told exactly anyway. 0: exact
// places.
PlacePrecision choose_precision(const TriangleMesh& mesh, const MergeHistory& history, const PositionGrid& grid,
                                double noise);

}  // namespace fanstream
