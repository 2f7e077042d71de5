// Bytes to a distance, uniform over the surface: ours beside one level of meshoptimizer's coded by Draco.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/mesh/triangle_mesh.h"
#include "tests/bench/open_asset.h"

namespace fanstream::bench {

struct RatePoint {
  double bytes = 0.0;
  double rms = 0.0;  // relative to the diagonal
};

// Where a curve of points with rising bytes first comes down to `rms`, straight between two points in logarithms. None
// where it never does; the first point's bytes where that is below already.
std::optional<double> bytes_at_rms(std::span<const RatePoint> curve, double rms);

struct RateAtRms {
  double rms = 0.0;  // asked for
  // Head, index and the segments of the asset, layer by layer, between FM0 and the ends of the layers interpolated.
  std::optional<double> layers_bytes;
  // The same in whole segments, nothing interpolated: the fewest, by falling bound of the cell's error, that come
  // down to the distance.
  std::optional<double> segments_bytes;
  // The coarsest level of meshoptimizer's (from the full model on its grid) that comes down to the distance, to a
  // thousandth of its triangles, coded by Draco 10 on that grid.
  std::size_t peer_bytes = 0;
  std::uint32_t peer_triangles = 0;
  double peer_rms = 0.0;
};

struct RateCurve {
  std::vector<RatePoint> layers;  // FM0 and each layer's end
  std::vector<RateAtRms> at;      // by the distances asked for
};

// Distances are both directions' with the asset's full model.
Result<RateCurve> measure_rates(const std::shared_ptr<const OpenAsset>& asset, std::span<const double> rms,
                                std::size_t face_samples);

}  // namespace fanstream::bench
