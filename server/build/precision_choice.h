// How exactly vertices are to be known at each generation: as the levels' own distances from the model deserve.
#pragma once

#include <vector>

#include "common/coding/place_precision.h"
#include "common/mesh/triangle_mesh.h"
#include "server/build/simplifier.h"

namespace fanstream {

struct LevelDistance {
  std::uint32_t vertices = 0;  // of the level
  double rms = 0.0;            // of the model from it, in the model's units
  // By generation up to the level's: the share of its surface, by the area around vertices, whose vertices are to be
  // split again and are known no better than on the lattice of that generation (PlacePrecision::known_in).
  std::vector<double> known_since;
};

// Of some levels of a history, each of about half the vertices of the one before, the finest of half the model's (and
// at most 50,000), the last FM0. From 4000 points spread over the model: good to some per cent. Parents lie where the
// history says. O(points log(vertices) + vertices).
std::vector<LevelDistance> measure_level_distances(const TriangleMesh& mesh, const MergeHistory& history);

// As many bits left out by each generation as make places off by at most `noise` times as far as the levels that show
// them are off the model (squares; on each axis, rms): its own level, and finer ones as far as their vertices have lain
// where they are since then. Since a face is off by less than its corners, the noise adds about a quarter of this to
// the distance; a bit of each axis is about an eighth of what a vertex costs. Nothing is left out from the generation
// on where two fifths of the vertices are never split again: these are told exactly anyway. 0: exact places.
PlacePrecision choose_precision(const TriangleMesh& mesh, const MergeHistory& history, const PositionGrid& grid,
                                double noise);

}  // namespace fanstream
