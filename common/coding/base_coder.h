// FM0 through Draco: integer positions that are not quantised again, connectivity by EdgeBreaker.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/fans/fan_split.h"
#include "common/support/result.h"

namespace fanstream {

// FM0 as triangles on the grid. After decoding, numbers and faces are those of the mesh that splits are applied to.
struct BaseMesh {
  std::vector<GridPoint> places;  // codes (PositionGrid)
  std::vector<Triangle> triangles;
};

// Draco numbers vertices and faces anew: decode the result to learn the order that counts. Fails only where Draco does.
Result<std::vector<std::byte>> encode_base(const BaseMesh& base);

// Checks that what Draco yields is an oriented manifold of at most `most_vertices` vertices. Safe on any bytes.
Result<BaseMesh> decode_base(std::span<const std::byte> bytes, std::uint32_t most_vertices);

}  // namespace fanstream
