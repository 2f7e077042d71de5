// A ring of random vertices around vertex 0, as LinkedFans holds it.
#pragma once

#include "common/coding/ring_geometry.h"
#include "tests/support/seeded_random.h"

namespace fanstream::testing {

struct RandomRing {
  LinkedFans fans;
  std::vector<VertexId> ring;       // as the fan starts; kOutside is somewhere in it if open
  std::vector<FanVertex> vertices;  // by number, no more than there are

  // Places lie within `reach` of the root, which lies anywhere; some coincide, so that ranks have ties. Every second
  // fan has been split before, so that it starts elsewhere.
  RandomRing(SeededRandom& random, std::uint32_t size, bool open, std::int32_t reach) {
    for (VertexId v = 1; v <= size; ++v) ring.push_back(v);
    random.shuffle(ring);
    if (open) ring[random.below(size)] = kOutside;
    std::vector<Triangle> faces;
    for (std::uint32_t i = 0; i < size; ++i) {
      const VertexId next = ring[(i + 1) % size];
      if (ring[i] != kOutside && next != kOutside) faces.push_back({0, ring[i], next});
    }
    random.shuffle(faces);  // which is where the fan starts
    const bool split = random.one_in(2);
    fans = LinkedFans(size + std::size_t{1}, faces);
    fans.resize(size + std::size_t{2});
    // The new vertex takes the place of one that the root loses, so that the ring is as large as before.
    if (split) fans.split(0, size + 1, removable(fans.ring(0)), (removable(fans.ring(0)) + 2) % size);
    ring = fans.ring(0);
    const auto point = [&](std::int32_t far) {
      return GridPoint(random.between(-far, far), random.between(-far, far), random.between(-far, far));
    };
    vertices.push_back({point(1000), {}});
    for (VertexId v = 1; v < size + (split ? 2 : 1); ++v) {
      const bool copy = v > 1 && random.one_in(6);
      const GridPoint place = copy ? vertices[v - 1].place : vertices[0].place + point(reach);
      vertices.push_back({place, {}});
    }
  }

  RingGeometry geometry(const glm::vec3& unit) const { return {fans, 0, vertices, float4(unit)}; }

 private:
  // The position before one that is not the outside.
  static std::uint32_t removable(std::span<const VertexId> ring) { return ring[1] == kOutside ? 1 : 0; }
};

}  // namespace fanstream::testing
