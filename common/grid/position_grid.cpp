#include "common/grid/position_grid.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace fanstream {
namespace {

// Listing an axis's values must save two bits a vertex at least, and cost far less than it saves.
bool worth_listing(std::size_t used, std::int32_t extent, std::size_t vertices) {
  return used * 4 <= static_cast<std::size_t>(extent) + 1 && used * 8 <= vertices;
}

}  // namespace

PositionGrid PositionGrid::fit(const std::vector<glm::dvec3>& positions, int bits) {
  PositionGrid grid;
  const Bounds box = bounds_of(positions);
  const glm::dvec3 size = box.high - box.low;
  const double longest = std::max({size.x, size.y, size.z});
  grid.bits_ = bits;
  grid.origin_ = box.low;
  grid.step_ = longest > 0.0 ? longest / ((1 << bits) - 1) : 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto extent = static_cast<std::int32_t>(std::lround(size[axis] / grid.step_));
    grid.extent_[static_cast<std::size_t>(axis)] = extent;
    std::vector<bool> used(static_cast<std::size_t>(extent) + 1, false);
    for (const glm::dvec3& p : positions) {
      used[static_cast<std::size_t>(std::lround((p[axis] - box.low[axis]) / grid.step_))] = true;
    }
    std::vector<std::int32_t> values;
    for (std::int32_t v = 0; v <= extent; ++v) {
      if (used[static_cast<std::size_t>(v)]) values.push_back(v);
    }
    if (!worth_listing(values.size(), extent, positions.size())) values.clear();
    grid.set_values(axis, std::move(values));
  }
  return grid;
}

int PositionGrid::default_bits(const TriangleMesh& mesh) {
  const Bounds box = bounds_of(mesh.positions);
  const glm::dvec3 size = box.high - box.low;
  const double longest = std::max({size.x, size.y, size.z});
  double total = 0.0;
  for (const Triangle& t : mesh.triangles) total += glm::length(mesh.positions[t[1]] - mesh.positions[t[0]]);
  if (!(total > 0.0) || !(longest > 0.0)) return 10;
  const double edge = total / static_cast<double>(mesh.triangles.size());
  return std::clamp(static_cast<int>(std::ceil(std::log2(24.0 * longest / edge))), 10, 16);
}

void PositionGrid::set_values(int axis, std::vector<std::int32_t> values) {
  const auto a = static_cast<std::size_t>(axis);
  code_counts_[a] = values.empty() ? extent_[a] + 1 : static_cast<std::int32_t>(values.size());
  const std::int32_t steps = code_counts_[a] - 1;
  unit_[axis] = steps > 0 ? static_cast<float>(extent_[a]) / static_cast<float>(steps) : 1.0F;
  values_[a] = std::move(values);
}

std::int32_t PositionGrid::to_code(int axis, std::int32_t value) const {
  const auto& values = values_[static_cast<std::size_t>(axis)];
  if (values.empty()) return value;
  const auto above = std::lower_bound(values.begin(), values.end(), value);
  if (above == values.begin()) return 0;
  const auto rank = static_cast<std::int32_t>(above - values.begin());
  if (above == values.end()) return rank - 1;
  return value - above[-1] < *above - value ? rank - 1 : rank;
}

GridPoint PositionGrid::encode(const glm::dvec3& position) const {
  GridPoint code;
  for (int axis = 0; axis < 3; ++axis) {
    const double value = std::round((position[axis] - origin_[axis]) / step_);
    const std::int32_t extent = extent_[static_cast<std::size_t>(axis)];
    code[axis] = to_code(axis, static_cast<std::int32_t>(std::clamp(value, 0.0, static_cast<double>(extent))));
  }
  return code;
}

glm::dvec3 PositionGrid::decode(const GridPoint& code) const { return origin_ + step_ * glm::dvec3(coordinates(code)); }

void PositionGrid::write(ByteWriter& out) const {
  out.u8(static_cast<std::uint8_t>(bits_));
  out.f64(step_);
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    out.f64(origin_[axis]);
    out.varint(static_cast<std::uint64_t>(extent_[a]));
    out.varint(values_[a].size());
    std::int32_t previous = -1;
    for (const std::int32_t v : values_[a]) {
      out.varint(static_cast<std::uint64_t>(v - previous));
      previous = v;
    }
  }
}

Result<PositionGrid> PositionGrid::read(ByteReader& in) {
  PositionGrid grid;
  grid.bits_ = in.u8();
  grid.step_ = in.f64();
  if (in.failed() || grid.bits_ < kLeastPositionBits || grid.bits_ > kMostPositionBits || !std::isfinite(grid.step_) ||
      !(grid.step_ > 0.0)) {
    return tl::unexpected(in.error("position grid", "impossible bits or step"));
  }
  for (int axis = 0; axis < 3; ++axis) {
    grid.origin_[axis] = in.f64();
    const std::uint64_t extent = in.varint();
    const std::uint64_t count = in.varint();
    if (in.failed() || !std::isfinite(grid.origin_[axis]) || extent >= (1ULL << grid.bits_) || count > extent + 1 ||
        count > in.remaining()) {
      return tl::unexpected(in.error("position grid", "impossible axis"));
    }
    grid.extent_[static_cast<std::size_t>(axis)] = static_cast<std::int32_t>(extent);
    std::vector<std::int32_t> values;
    values.reserve(count);
    std::int64_t previous = -1;
    for (std::uint64_t i = 0; i < count; ++i) {
      const std::uint64_t gap = in.varint();
      if (in.failed() || gap == 0 || gap > extent + 1 ||
          previous + static_cast<std::int64_t>(gap) > static_cast<std::int64_t>(extent)) {
        return tl::unexpected(in.error("position grid", "axis values out of order"));
      }
      previous += static_cast<std::int64_t>(gap);
      values.push_back(static_cast<std::int32_t>(previous));
    }
    grid.set_values(axis, std::move(values));
  }
  return grid;
}

}  // namespace fanstream
