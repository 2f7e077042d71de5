// Faces and their edges drawn by a small software rasteriser: wireframes for the pictures, exact coverage for measuring
// outlines. The client's renderer draws no lines.
#pragma once

#include <cstdint>
#include <vector>

#include "client/render/image.h"
#include "client/subdivide/adaptive_subdivision.h"
#include "client/view/criteria.h"

namespace fanstream::bench {

// Every face in a shade of its normal and a tint of its depth (pale: coarse, dark: fine), edges dark, hidden lines
// removed. Depths may be empty.
Image draw_faces(const PolygonMesh& mesh, const std::vector<std::uint8_t>& depths, const View& view);

// What a mesh covers of the picture of a view, at `scale` samples per pixel and axis.
struct Coverage {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t scale = 1;
  std::vector<std::uint8_t> inside;
};
Coverage cover(const PolygonMesh& mesh, const View& view, std::uint32_t scale);

// How far the outline of what is drawn is off the outline of what should be, in pixels: the area between the two by the
// length of the right one, and the greatest distance of a sample in that area from it. Precondition: same size.
struct OutlineError {
  double mean_px = 0.0;
  double max_px = 0.0;
};
OutlineError outline_error(const Coverage& drawn, const Coverage& right);

}  // namespace fanstream::bench
