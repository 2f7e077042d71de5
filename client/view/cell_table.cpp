#include "client/view/cell_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <glm/geometric.hpp>
#include <tuple>

namespace fanstream {
namespace {

constexpr std::uint64_t kMostCells = 1U << 22;
constexpr std::uint32_t kMostLayers = 250;  // of all slabs together
constexpr std::size_t kMostSlabs = 255;
constexpr float kConeRounding = 1e-6F;  // more than the angle by which a rounded axis is off

// Finest first. What a coarser generation needs already is not needed again.
void sort_and_prune(std::vector<Dependency>& list) {
  std::sort(list.begin(), list.end(), [](const Dependency& a, const Dependency& b) {
    return std::tuple(a.cell, a.generation, b.on) < std::tuple(b.cell, b.generation, a.on);
  });
  std::size_t kept = 0;
  for (const Dependency& d : list) {
    if (kept > 0 && list[kept - 1].cell == d.cell && list[kept - 1].on >= d.on) continue;
    list[kept++] = d;
  }
  list.resize(kept);
  std::sort(list.begin(), list.end(), [](const Dependency& a, const Dependency& b) {
    return std::tuple(b.generation, a.cell) < std::tuple(a.generation, b.cell);
  });
}

}  // namespace

Result<CellTable> CellTable::create(std::span<const SlabShape> slabs, std::span<const std::uint32_t> child_counts) {
  std::uint64_t cells = 0;
  std::uint32_t layers = 0;
  std::uint64_t steps = 0;
  if (slabs.size() > kMostSlabs) return fail(ErrorKind::bad_input, fmt::format("cell table: {} slabs", slabs.size()));
  CellTable table;
  for (const SlabShape& slab : slabs) {
    if (slab.layer_count == 0 || slab.layer_count > kMostLayers - layers || slab.cell_count > kMostCells - cells) {
      return fail(ErrorKind::bad_input,
                  fmt::format("cell table: slab {} with {} cells and {} layers is beyond the limits",
                              table.slabs_.size(), slab.cell_count, slab.layer_count));
    }
    Slab& made = table.slabs_.emplace_back();
    made.first_cell = static_cast<std::uint32_t>(cells);
    made.cell_count = slab.cell_count;
    made.layer_count = slab.layer_count;
    made.first_step = static_cast<std::uint32_t>(steps);
    made.first_layer = layers;
    made.generations.assign(slab.layer_count, 1);
    count_generations(made);
    cells += slab.cell_count;
    layers += slab.layer_count;
    steps += static_cast<std::uint64_t>(slab.cell_count) * slab.layer_count;
  }
  const std::uint64_t inner = slabs.empty() ? 0 : cells - slabs.back().cell_count;
  if (child_counts.size() != inner) {
    return fail(ErrorKind::bad_input,
                fmt::format("cell table: {} counts of children for {} cells", child_counts.size(), inner));
  }
  table.parent_.assign(cells, kNoCell);
  table.first_child_.reserve(inner + 1);
  table.slab_of_.resize(cells);
  for (std::uint32_t s = 0; s < table.slabs_.size(); ++s) {
    const Slab& slab = table.slabs_[s];
    std::fill_n(table.slab_of_.begin() + slab.first_cell, slab.cell_count, static_cast<std::uint8_t>(s));
    if (s + 1 == table.slabs_.size()) break;
    std::uint64_t child = slab.first_cell + slab.cell_count;
    const std::uint64_t end = child + table.slabs_[s + 1].cell_count;
    for (std::uint32_t c = slab.first_cell; c < slab.first_cell + slab.cell_count; ++c) {
      if (child_counts[c] > end - child)
        return fail(ErrorKind::bad_input, fmt::format("cell table: cell {} has children beyond slab {}", c, s + 1));
      table.first_child_.push_back(static_cast<std::uint32_t>(child));
      for (std::uint32_t i = 0; i < child_counts[c]; ++i) table.parent_[child++] = c;
    }
    if (child != end)
      return fail(ErrorKind::bad_input,
                  fmt::format("cell table: {} cells of slab {} lack a parent", end - child, s + 1));
  }
  table.first_child_.push_back(static_cast<std::uint32_t>(cells));
  table.errors_.grow(steps, PageKind::small);
  table.sizes_bytes_ = NarrowCounts(steps);
  table.triangles_ = NarrowCounts(steps);
  table.applied_.resize(cells);
  table.begun_.resize(cells);
  table.held_.resize(cells);
  table.extent_numbers_.assign(cells, kNoExtent);
  table.needs_ = DependencyLists(cells);
  table.supports_ = DependencyLists(cells);
  table.dependency_epochs_.resize((cells + kEpochCells - 1) / kEpochCells);
  table.epoch_ = 1;
  return table;
}

void CellTable::set_segment(std::uint32_t cell, std::uint32_t segment, const CellSegment& values) {
  assert(cell < cell_count() && segment < segment_count(cell));
  const std::uint32_t step = step_index(cell, segment + 1);
  const bool is_begun = segment < begun_[cell];
  const bool is_held = segment < held_[cell];
  if (is_begun) {
    begun_triangles_ += std::uint64_t{values.triangles} - triangles_[step];
    begun_bytes_ += std::uint64_t{values.size_bytes} - sizes_bytes_[step];
  }
  if (is_held) held_bytes_ += std::uint64_t{values.size_bytes} - sizes_bytes_[step];
  errors_[step] = values.error;
  sizes_bytes_.set(step, values.size_bytes);
  triangles_.set(step, values.triangles);
  ++epoch_;
}

void CellTable::set_base(std::uint64_t triangles, std::uint64_t memory_bytes) {
  base_triangles_ = triangles;
  base_memory_bytes_ = memory_bytes;
  ++epoch_;
}

Result<void> CellTable::check_errors() const {
  for (std::uint32_t c = 0; c < cell_count(); ++c) {
    float coarser = parent_[c] == kNoCell ? INFINITY : errors_[step_index(parent_[c], segment_count(parent_[c]))];
    for (std::uint32_t p = 1; p <= segment_count(c); ++p) {
      const float error = errors_[step_index(c, p)];
      if (!std::isfinite(error) || error < 0.0F || error > coarser) {
        return fail(ErrorKind::bad_input,
                    fmt::format("cell {} segment {}: error bound {} after {}", c, p - 1, error, coarser));
      }
      coarser = error;
    }
  }
  return {};
}

void CellTable::count_generations(Slab& slab) {
  slab.step_of.clear();
  slab.last_generation.clear();
  for (std::uint32_t layer = 0; layer < slab.layer_count; ++layer) {
    slab.step_of.insert(slab.step_of.end(), slab.generations[layer], static_cast<std::uint8_t>(layer + 1));
    slab.last_generation.push_back(static_cast<std::uint32_t>(slab.step_of.size()));
  }
  slab.generation_count = static_cast<std::uint32_t>(slab.step_of.size());
}

void CellTable::set_layer_generations(std::uint32_t slab, std::uint32_t layer, std::uint32_t generations) {
  assert(slab < slab_count() && layer < layers_of(slab) && generations >= 1 && generations <= 255);
  slabs_[slab].generations[layer] = static_cast<std::uint8_t>(generations);
  count_generations(slabs_[slab]);
  joins_generations_ = joins_generations_ || generations > 1;
  ++epoch_;
}

void CellTable::set_applied(std::uint32_t cell, std::uint32_t prefix, std::uint32_t begun) {
  assert(cell < cell_count() && prefix <= begun && begun <= prefix + 1 && begun <= segment_count(cell));
  if (applied_[cell] == prefix && begun_[cell] == begun) return;
  for (std::uint32_t p = begun_[cell] + 1U; p <= begun; ++p) {
    begun_triangles_ += triangles_[step_index(cell, p)];
    begun_bytes_ += sizes_bytes_[step_index(cell, p)];
  }
  for (std::uint32_t p = begun + 1; p <= begun_[cell]; ++p) {
    begun_triangles_ -= triangles_[step_index(cell, p)];
    begun_bytes_ -= sizes_bytes_[step_index(cell, p)];
  }
  applied_[cell] = static_cast<std::uint8_t>(prefix);
  begun_[cell] = static_cast<std::uint8_t>(begun);
  ++epoch_;
}

void CellTable::set_held(std::uint32_t cell, std::uint32_t prefix) {
  assert(cell < cell_count() && prefix <= segment_count(cell));
  if (held_[cell] == prefix) return;
  for (std::uint32_t p = held_[cell]; p < prefix; ++p) held_bytes_ += sizes_bytes_[step_index(cell, p + 1)];
  for (std::uint32_t p = prefix; p < held_[cell]; ++p) held_bytes_ -= sizes_bytes_[step_index(cell, p + 1)];
  held_[cell] = static_cast<std::uint8_t>(prefix);
  ++epoch_;
}

CellTable::KeptSphere CellTable::kept_sphere(const glm::dvec3& center, double radius) const {
  KeptSphere kept{glm::vec3(center - origin_), 0.0F};
  const double wider = radius + glm::length(glm::dvec3(kept.center) + origin_ - center);
  kept.radius = static_cast<float>(wider);
  if (kept.radius < wider) kept.radius = std::nextafter(kept.radius, INFINITY);
  return kept;
}

void CellTable::set_extent(std::uint32_t cell, const CellExtent& extent, std::span<const ExtentPart> parts) {
  assert(cell < cell_count());
  if (!extent_known(cell)) {
    extent_numbers_[cell] = extent_count();
    if (extents_.size() == extents_.capacity()) extents_.reserve(extents_.size() + extents_.size() / 4 + 16);
    KeptExtent& made = extents_.emplace_back();
    made.parts_begin = static_cast<std::uint32_t>(parts_.size());
    made.part_count = static_cast<std::uint32_t>(parts.size());
    parts_.resize(parts_.size() + parts.size());
  }
  KeptExtent& kept = extents_[extent_numbers_[cell]];
  assert(parts.size() == kept.part_count);
  kept.sphere = kept_sphere(extent.center, extent.radius);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    parts_[kept.parts_begin + i] = kept_sphere(parts[i].center, parts[i].radius);
  }
  kept.cone_axis = extent.cone_axis;
  kept.cone_cosine = static_cast<float>(extent.cone_cosine);
  if (glm::dvec3(kept.cone_axis) != extent.cone_axis || kept.cone_cosine != extent.cone_cosine)
    kept.cone_cosine = std::max(-1.0F, kept.cone_cosine - kConeRounding);
  kept.epoch = ++epoch_;
}

void CellTable::copy_parts(std::uint32_t cell, std::vector<ExtentPart>& parts) const {
  parts.clear();
  if (!extent_known(cell)) return;
  const KeptExtent& kept = extents_[extent_numbers_[cell]];
  for (std::uint32_t i = 0; i < kept.part_count; ++i) {
    const KeptSphere& part = parts_[kept.parts_begin + i];
    parts.push_back({glm::dvec3(part.center) + origin_, part.radius});
  }
}

CellExtent CellTable::extent(std::uint32_t cell) const {
  if (!extent_known(cell)) return {};
  const KeptExtent& kept = extents_[extent_numbers_[cell]];
  return {glm::dvec3(kept.sphere.center) + origin_, kept.sphere.radius, kept.cone_axis, kept.cone_cosine};
}

void CellTable::set_supports(std::uint32_t cell, std::span<const Dependency> supports) {
  assert(cell < cell_count());
  scratch_.assign(supports.begin(), supports.end());
  sort_and_prune(scratch_);
  const std::span<const Dependency> before = supports_[cell];
  if (std::equal(scratch_.begin(), scratch_.end(), before.begin(), before.end())) return;
  supports_.set(cell, scratch_);
  dependency_epochs_[cell / kEpochCells] = dependency_epoch_ = ++epoch_;
}

void CellTable::add_needs(std::uint32_t cell, std::span<const Dependency> needs) {
  assert(cell < cell_count());
  const std::span<const Dependency> before = needs_[cell];
  scratch_.assign(before.begin(), before.end());
  for (const Dependency& need : needs) {
    assert(need.generation >= 1 && need.generation <= generations_of(slab_of_[cell]) && need.on >= 1);
    assert(need.cell < cell_count() && need.cell != cell);
    assert(slab_of_[need.cell] < slab_of_[cell] ||
           (slab_of_[need.cell] == slab_of_[cell] && need.on < need.generation));
    scratch_.push_back(need);
  }
  sort_and_prune(scratch_);
  if (std::equal(scratch_.begin(), scratch_.end(), before.begin(), before.end())) return;
  needs_.set(cell, scratch_);
  dependency_epochs_[cell / kEpochCells] = dependency_epoch_ = ++epoch_;
}

float CellTable::error_at(std::uint32_t cell, std::uint32_t p) const {
  if (p < segment_count(cell)) return errors_[step_index(cell, p + 1)];
  float largest = 0.0F;
  for (std::uint32_t i = 0; i < child_count(cell); ++i)
    largest = std::max(largest, errors_[step_index(first_child(cell) + i, 1)]);
  return largest;
}

std::uint32_t CellTable::held(std::uint32_t cell) const {
  std::uint32_t p = held_[cell];
  const std::uint32_t count = segment_count(cell);
  while (p < count && sizes_bytes_[step_index(cell, p + 1)] == 0) ++p;
  return p;
}

}  // namespace fanstream
