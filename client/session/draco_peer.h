// The peer that every session is measured beside: the whole model as one Draco file, which shows nothing until all of
// it has come and been decoded.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "client/session/virtual_link.h"
#include "common/mesh/triangle_mesh.h"
#include "common/support/result.h"

namespace fanstream {

// A mesh on an integer grid. Vertices may share a grid point and remain distinct vertices.
struct GridMesh {
  std::vector<std::array<std::int32_t, 3>> positions;
  std::vector<Triangle> triangles;
};

// Grid coordinates of a mesh whose positions lie on a grid of this step (an asset's full model), counted from the lower
// corner of its bounds. Fails (bad_input) where a position is further than a tenth of a step from every grid point, and
// (limit) where a coordinate would be 2^30 or more. Precondition: step_size > 0.
Result<GridMesh> grid_mesh(const TriangleMesh& mesh, double step_size);

// Seconds are CPU time of the calling thread; Draco uses no other.
struct DracoFile {
  std::vector<std::byte> bytes;
  double encode_seconds = 0.0;  // once
  double decode_seconds = 0.0;  // median of the repetitions
};

// Encodes with EdgeBreaker at a compression level of 0 (fastest) to 10 (smallest), that is Draco's speed 10 - level for
// both encoding and decoding, and decodes `decode_repetitions` times. Positions go in as integers, so Draco's own
// quantisation has no part in it. Fails with usage for a level or repetitions out of range, with bad_input for a mesh
// without triangles or with indices out of range, and where Draco fails or does not give back every triangle and at
// least every position.
Result<DracoFile> make_draco_file(const GridMesh& mesh, int level, int decode_repetitions = 5);

// Decodes the file of this mesh once more. Returns the seconds; fails as make_draco_file does.
Result<double> decode_draco_file(const DracoFile& file, const GridMesh& mesh);

// A download of a whole file and what it takes until it can be drawn.
struct PeerDownload {
  std::uint64_t size_bytes = 0;
  double download_s = 0.0;  // see virtual_link.h
  double decode_s = 0.0;
  double picture_s() const { return download_s + decode_s; }
};
PeerDownload download_of(const DracoFile& file, const VirtualLinkOptions& link);

}  // namespace fanstream
