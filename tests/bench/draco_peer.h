// Draco 1.5.5 as the yardstick for sizes and decoding rates: a mesh whose positions lie on an integer grid, coded with
// EdgeBreaker. Positions go in as integers, so Draco's own quantisation has no part in it.
#pragma once

#include <cstddef>

#include "client/session/draco_peer.h"
#include "common/mesh/triangle_mesh.h"
#include "common/support/result.h"

namespace fanstream::bench {

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

// What is known of a file of this mesh.
DracoResult draco_result(const DracoFile& file, const GridMesh& mesh);
// Encodes and decodes as make_draco_file does, with its errors.
Result<DracoResult> measure_draco(const GridMesh& mesh, int level, int decode_repetitions = 5);

}  // namespace fanstream::bench
