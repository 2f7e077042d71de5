// The one integer grid of an asset: base and splits share it, nothing is quantised twice.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "common/fans/fan_split.h"
#include "common/mesh/triangle_mesh.h"
#include "common/support/byte_io.h"

namespace fanstream {

inline constexpr int kLeastPositionBits = 6;
inline constexpr int kMostPositionBits = 20;

// A uniform grid of 2^bits points along the longest axis. On an axis where a model uses few of the grid's values
// (height fields, CAD), points are numbered by those values alone: their codes are ranks in the axis's list. Codes, not
// grid coordinates, are what FanSplits carry. Immutable once made.
class PositionGrid {
 public:
  PositionGrid() = default;
  // The grid of a model. Precondition: positions are finite and not empty, bits in [kLeastPositionBits,
  // kMostPositionBits].
  static PositionGrid fit(const std::vector<glm::dvec3>& positions, int bits);
  // Bits at which one step is at most a 24th of the mean edge length, within 10..16: coarser steps show in shaded
  // normals, finer ones code noise.
  static int default_bits(const TriangleMesh& mesh);

  int bits() const { return bits_; }
  double step() const { return step_; }
  // Codes of an axis run from 0 to code_count - 1.
  std::int32_t code_count(int axis) const { return code_counts_[static_cast<std::size_t>(axis)]; }
  // Whether codes of an axis are ranks in a list of values.
  bool is_listed(int axis) const { return !values_[static_cast<std::size_t>(axis)].empty(); }
  bool contains(const GridPoint& code) const {
    const auto below = [](std::int32_t value, std::int32_t count) {
      return static_cast<std::uint32_t>(value) < static_cast<std::uint32_t>(count);
    };
    return below(code.x, code_counts_[0]) && below(code.y, code_counts_[1]) && below(code.z, code_counts_[2]);
  }
  // The mean distance between neighbouring codes in grid steps, by axis.
  glm::vec3 unit() const { return unit_; }

  GridPoint encode(const glm::dvec3& position) const;  // the nearest point; exact for points of the fitted model
  // Precondition of both: contains(code).
  glm::dvec3 decode(const GridPoint& code) const;
  // Of all that lies on the grid, in the model's coordinates.
  Bounds bounds() const {
    return {decode(GridPoint(0)), decode({code_count(0) - 1, code_count(1) - 1, code_count(2) - 1})};
  }
  GridPoint coordinates(const GridPoint& code) const {  // in grid steps, below 2^bits
    return {coordinate(0, code.x), coordinate(1, code.y), coordinate(2, code.z)};
  }

  void write(ByteWriter& out) const;
  static Result<PositionGrid> read(ByteReader& in);

 private:
  std::int32_t coordinate(std::size_t axis, std::int32_t code) const {
    const std::vector<std::int32_t>& values = values_[axis];
    return values.empty() ? code : values[static_cast<std::size_t>(code)];
  }
  std::int32_t to_code(int axis, std::int32_t value) const;
  void set_values(int axis, std::vector<std::int32_t> values);

  int bits_ = kLeastPositionBits;
  double step_ = 1.0;
  glm::dvec3 origin_{0.0};
  std::array<std::int32_t, 3> extent_{};             // largest grid coordinate
  std::array<std::vector<std::int32_t>, 3> values_;  // empty: the code is the grid coordinate
  std::array<std::int32_t, 3> code_counts_{1, 1, 1};
  glm::vec3 unit_{1.0F};
};

}  // namespace fanstream
