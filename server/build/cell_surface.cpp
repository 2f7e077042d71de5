#include "server/build/cell_surface.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace fanstream {

CellSurface::Cell& CellSurface::at(std::uint32_t cell) {
  if (cell >= cells_.size()) cells_.resize(cell + 1);
  return cells_[cell];
}

void CellSurface::add(std::uint32_t cell, std::uint32_t merge) {
  Cell& c = at(cell);
  const std::uint32_t patch = surface_.patch_of[merge];
  c.current = std::max(c.current, surface_.patches[patch].error);
  if (c.patches.empty() || c.patches.back() != patch) c.patches.push_back(patch);
}

void CellSurface::end_layer(std::uint32_t cell) {
  Cell& c = at(cell);
  c.errors.push_back(c.current);
  c.current = 0.0F;
}

void CellSurface::finish(const std::vector<CellEntry>& cells) {
  for (std::size_t c = cells_.size(); c-- > 0;) {
    std::vector<float>& own = cells_[c].errors;
    std::vector<std::uint32_t>& patches = cells_[c].patches;
    for (std::uint32_t child = cells[c].first_child; child < cells[c].first_child + cells[c].child_count; ++child) {
      own.back() = std::max(own.back(), cells_[child].errors.front());
      patches.insert(patches.end(), cells_[child].patches.begin(), cells_[child].patches.end());
    }
    for (std::size_t s = own.size() - 1; s-- > 0;) own[s] = std::max(own[s], own[s + 1]);
  }
}

// Around the mean of the patches' axes.
CodedCone CellSurface::cone(std::uint32_t cell) const {
  glm::dvec3 sum(0.0);
  for (const std::uint32_t p : cells_[cell].patches) {
    const NormalCone& cone = surface_.patches[p].normals;
    if (!(cone.cosine > -1.0F)) return {};
    sum += glm::dvec3(cone.axis);
  }
  const double length = glm::length(sum);
  if (!(length > 0.0)) return {};
  const glm::dvec3 axis = sum / length;
  const auto angle = [](double cosine) { return std::acos(std::clamp(cosine, -1.0, 1.0)); };
  double widest = 0.0;
  for (const std::uint32_t p : cells_[cell].patches) {
    const NormalCone& cone = surface_.patches[p].normals;
    const glm::dvec3 own = glm::normalize(glm::dvec3(cone.axis));
    widest = std::max(widest, angle(glm::dot(axis, own)) + angle(static_cast<double>(cone.cosine)));
  }
  constexpr double kSlack = 1e-5;  // of single precision
  constexpr double kRightAngle = 1.57;
  if (widest + kSlack >= kRightAngle) return {};
  return code_cone(glm::vec3(axis), static_cast<float>(std::cos(widest + kSlack)));
}

}  // namespace fanstream
