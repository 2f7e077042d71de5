// Draco 1.5.5 as the yardstick for sizes and decoding rates: a mesh whose positions lie on an integer grid, coded with
// EdgeBreaker. Positions go in as integers, so Draco's own quantisation has no part in it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/mesh/triangle_mesh.h"
#include "common/support/result.h"

namespace fanstream::bench {

// A mesh on an integer grid. Vertices may share a grid point and remain distinct vertices.
struct GridMesh {
  std::vector<std::array<std::int32_t, 3>> positions;
  std::vector<Triangle> triangles;
};

// Puts a mesh on a grid of 2^bits - 1 steps along the longest side of its bounds, the same step for all axes, counted
// from the lower corner and rounded to the nearest: the grid that Draco's own quantiser uses. bits: 1 to 30.
// No vertex and no triangle is lost or merged.
GridMesh on_grid(const TriangleMesh& mesh, unsigned bits);

// Seconds are CPU time of the calling thread; Draco uses no other.
struct DracoResult {
  std::size_t size_bytes = 0;
  double bits_per_vertex = 0.0;
  double encode_seconds = 0.0;       // once
  double decode_seconds = 0.0;       // median of the repetitions
  double decode_mtriangles_s = 0.0;  // millions of triangles per second
};

// Encodes at a compression level of 0 (fastest) to 10 (smallest), that is Draco's speed 10 - level for both encoding
// and decoding, and decodes `decode_repetitions` times. Fails with usage for a level or repetitions out of range, with
// bad_input for a mesh without triangles or with indices out of range, and where Draco fails or does not give back
// every triangle and at least every position.
Result<DracoResult> measure_draco(const GridMesh& mesh, int level, int decode_repetitions = 5);

}  // namespace fanstream::bench
