#include "server/build/cell_surface.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace fanstream {

CellSurface::Cell& CellSurface::at(std::uint32_t cell) {
  if (cell >= cells_.size()) cells_.resize(cell + 1);
  return cells_[cell];
}

void CellSurface::add(std::uint32_t cell, std::uint32_t merge) { at(cell).merges.push_back(merge); }

void CellSurface::end_layer(std::uint32_t cell) {
  Cell& c = at(cell);
  c.layer_ends.push_back(static_cast<std::uint32_t>(c.merges.size()));
}

void CellSurface::read(const SurfaceErrors& surface, Cell& cell) {
  std::uint32_t m = 0;
  for (const std::uint32_t end : cell.layer_ends) {
    float& error = cell.errors.emplace_back(0.0F);
    for (; m < end; ++m) {
      const std::uint32_t patch = surface.patch_of[cell.merges[m]];
      error = std::max(error, surface.patches[patch].error);
      if (cell.patches.empty() || cell.patches.back() != patch) cell.patches.push_back(patch);
    }
  }
}

void CellSurface::finish(const SurfaceErrors& surface, const std::vector<CellEntry>& cells) {
  for (std::size_t c = cells_.size(); c-- > 0;) {
    read(surface, cells_[c]);
    std::vector<float>& own = cells_[c].errors;
    std::vector<std::uint32_t>& patches = cells_[c].patches;
    for (std::uint32_t child = cells[c].first_child; child < cells[c].first_child + cells[c].child_count; ++child) {
      own.back() = std::max(own.back(), cells_[child].errors.front());
      patches.insert(patches.end(), cells_[child].patches.begin(), cells_[child].patches.end());
    }
    for (std::size_t s = own.size() - 1; s-- > 0;) own[s] = std::max(own[s], own[s + 1]);
    cells_[c].cone = cone_of(surface, patches);
  }
}

CodedCone CellSurface::cone_of(const SurfaceErrors& surface, const std::vector<std::uint32_t>& patches) {
  constexpr double kRightAngle = 1.57;  // wider ones are of no use
  cones_.clear();
  for (const std::uint32_t p : patches) cones_.push_back(surface.patches[p].normals);
  const std::optional<WideCone> all = cone_around(cones_);
  if (!all || all->half_angle >= kRightAngle) return {};
  return code_cone(glm::vec3(all->axis), static_cast<float>(std::cos(all->half_angle)));
}

}  // namespace fanstream
