// Boxes in single precision, four side by side, that answer a question in a few instructions; and the coordinates in
// which they are: steps of a model's grid, so that floats are fine enough wherever the model lies and however large it
// is. Boxes are a little too wide, never too narrow.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>

#include "common/grid/position_grid.h"
#include "common/mesh/triangle_mesh.h"
#include "common/support/vector4.h"

namespace fanstream {

// The box of nothing: what is added to it is the sum.
inline constexpr Bounds kNoBounds{glm::dvec3(std::numeric_limits<double>::infinity()),
                                  glm::dvec3(-std::numeric_limits<double>::infinity())};
Bounds united(const Bounds& a, const Bounds& b);

inline Float4 lower(Float4 a, Float4 b) { return a < b ? a : b; }
inline Float4 upper(Float4 a, Float4 b) { return a > b ? a : b; }

// Bit k is lane k of a mask.
inline std::uint32_t lane_bits(Uint4 mask) {
#ifdef __SSE__
  return static_cast<std::uint32_t>(__builtin_ia32_movmskps(std::bit_cast<Float4>(mask)));
#else
  return any_bits(mask & Uint4{1, 2, 4, 8});
#endif
}

struct FloatBox {
  // Finite, so that no product of it is undefined.
  static constexpr float kFarthest = 3e38F;
  std::array<float, 3> low{kFarthest, kFarthest, kFarthest};  // of nothing
  std::array<float, 3> high{-kFarthest, -kFarthest, -kFarthest};

  bool is_empty() const { return low[0] > high[0]; }
  void include(const FloatBox& other) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], other.low[axis]);
      high[axis] = std::max(high[axis], other.high[axis]);
    }
  }
  friend bool operator==(const FloatBox&, const FloatBox&) = default;
};

struct FourBoxes {
  // The low ends by axis, then the high ends.
  std::array<Float4, 6> ends{float4(FloatBox::kFarthest),  float4(FloatBox::kFarthest),  float4(FloatBox::kFarthest),
                             float4(-FloatBox::kFarthest), float4(-FloatBox::kFarthest), float4(-FloatBox::kFarthest)};

  FloatBox box(std::size_t lane) const {
    FloatBox result;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      result.low[axis] = ends[axis][lane];
      result.high[axis] = ends[3 + axis][lane];
    }
    return result;
  }
  void set(std::size_t lane, const FloatBox& box) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      ends[axis][lane] = box.low[axis];
      ends[3 + axis][lane] = box.high[axis];
    }
  }
  FloatBox sum() const {
    FloatBox all;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Float4 l = ends[axis];
      const Float4 h = ends[3 + axis];
      all.low[axis] = std::min(std::min(l[0], l[1]), std::min(l[2], l[3]));
      all.high[axis] = std::max(std::max(h[0], h[1]), std::max(h[2], h[3]));
    }
    return all;
  }
  Uint4 filled() const { return mask_of(ends[0] <= ends[3]); }
};

// From a model's coordinates to those of boxes: origin + step * p. Points of the model go from 0 to `extent`.
struct BoxFrame {
  glm::dvec3 origin{0.0};
  double step = 1.0;
  double extent = 1.0;
  double padding = 0.125;  // what boxes are widened by at each side, and more than points of the model are rounded by

  static BoxFrame of(const PositionGrid& grid);

  glm::vec3 to_float(const glm::dvec3& p) const {
    const glm::dvec3 local = (p - origin) * (1.0 / step);
    return {limited(local.x), limited(local.y), limited(local.z)};
  }
  FloatBox around(const Bounds& box) const;
  // A box around it in the model's coordinates; kNoBounds of nothing.
  Bounds bounds(const FloatBox& box) const;

 private:
  static float limited(double value) {
    constexpr auto kMost = static_cast<double>(FloatBox::kFarthest);
    return static_cast<float>(std::clamp(value, -kMost, kMost));
  }
};

}  // namespace fanstream
