// A ring of random vertices around vertex 0, as RingMesh would hold it.
#pragma once

#include "common/coding/ring_geometry.h"
#include "tests/support/seeded_random.h"

namespace fanstream::testing {

struct RandomRing {
  std::vector<VertexId> ring;     // 1..n in random order, with kOutside somewhere if open
  std::vector<GridPoint> places;  // by vertex

  // Places lie within `reach` of the root, which lies anywhere; some coincide, so that ranks have ties.
  RandomRing(SeededRandom& random, std::uint32_t size, bool open, std::int32_t reach) {
    for (VertexId v = 1; v <= size; ++v) ring.push_back(v);
    random.shuffle(ring);
    if (open) ring[random.below(size)] = kOutside;
    const auto point = [&](std::int32_t far) {
      return GridPoint(random.between(-far, far), random.between(-far, far), random.between(-far, far));
    };
    places.push_back(point(1000));
    for (VertexId v = 1; v <= size; ++v) {
      const bool copy = v > 1 && random.one_in(6);
      const GridPoint place = copy ? places[v - 1] : places[0] + point(reach);
      places.push_back(place);
    }
  }

  RingGeometry geometry(const glm::vec3& unit) const {
    RingGeometry geometry;
    geometry.assign(ring, 0, places, unit);
    return geometry;
  }
};

}  // namespace fanstream::testing
