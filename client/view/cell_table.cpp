#include "client/view/cell_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace fanstream {
namespace {

constexpr std::uint64_t kMostCells = 1U << 22;
constexpr std::uint32_t kMostLayers = 250;  // of all slabs together
constexpr std::size_t kMostSlabs = 255;

void sort_unique(std::vector<std::uint32_t>& cells) {
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
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
    table.slabs_.push_back({static_cast<std::uint32_t>(cells), slab.cell_count, slab.layer_count,
                            static_cast<std::uint32_t>(steps), std::vector<std::uint8_t>(slab.layer_count, 1)});
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
  table.first_child_.assign(cells, 0);
  table.child_count_.assign(cells, 0);
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
      table.first_child_[c] = static_cast<std::uint32_t>(child);
      table.child_count_[c] = child_counts[c];
      for (std::uint32_t i = 0; i < child_counts[c]; ++i) table.parent_[child++] = c;
    }
    if (child != end)
      return fail(ErrorKind::bad_input,
                  fmt::format("cell table: {} cells of slab {} lack a parent", end - child, s + 1));
  }
  table.errors_.resize(steps);
  table.sizes_bytes_.resize(steps);
  table.triangles_.resize(steps);
  table.applied_.resize(cells);
  table.begun_.resize(cells);
  table.held_.resize(cells);
  table.extents_.resize(cells);
  table.extent_epoch_.resize(cells);
  table.links_.resize(cells);
  table.supports_.resize(cells);
  table.epoch_ = 1;
  // What holds whatever the neighbours: the parent comes first.
  for (std::uint32_t c = 0; c < cells; ++c) {
    table.links_[c].begin = static_cast<std::uint32_t>(table.pool_.size());
    if (table.parent_[c] == kNoCell) continue;
    table.pool_.push_back(table.parent_[c]);
    table.links_[c].foundation_count = table.links_[c].capacity = 1;
  }
  table.pool_used_ = table.pool_.size();
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
  sizes_bytes_[step] = values.size_bytes;
  triangles_[step] = values.triangles;
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

void CellTable::set_layer_generations(std::uint32_t slab, std::uint32_t layer, std::uint32_t generations) {
  assert(slab < slab_count() && layer < layers_of(slab) && generations >= 1 && generations <= 255);
  slabs_[slab].generations[layer] = static_cast<std::uint8_t>(generations);
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

void CellTable::set_extent(std::uint32_t cell, const CellExtent& extent) {
  assert(cell < cell_count());
  extents_[cell] = extent;
  extent_epoch_[cell] = ++epoch_;
}

void CellTable::set_supports(std::uint32_t cell, std::span<const Support> supports) {
  assert(cell < cell_count());
  supports_[cell].assign(supports.begin(), supports.end());
  ++epoch_;
}

void CellTable::set_neighbours(std::uint32_t cell, std::span<const std::uint32_t> cells) {
  assert(cell < cell_count());
  if (cells.empty()) return;
  const std::uint32_t slab = slab_of_[cell];
  auto& peers = scratch_peers_;
  auto& foundations = scratch_foundations_;
  peers.clear();
  foundations.clear();
  for (std::uint32_t n : cells) {
    assert(n < cell_count());
    while (slab_of_[n] > slab) n = parent_[n];  // what it would be were it coarsened as far as this cell
    if (n == cell) continue;
    if (slab_of_[n] < slab) {
      foundations.push_back(n);
      continue;
    }
    peers.push_back(n);
    if (slab > 0) foundations.push_back(parent_[n]);
  }
  sort_unique(peers);
  sort_unique(foundations);
  if (slab > 0) {
    std::erase(foundations, parent_[cell]);
    foundations.insert(foundations.begin(), parent_[cell]);
  }
  Links& links = links_[cell];
  const auto count = static_cast<std::uint32_t>(peers.size() + foundations.size());
  if (count > links.capacity) {
    if (pool_.size() > 2 * pool_used_ + 1024) compact_pool();
    pool_used_ += count - links.capacity;
    links.begin = static_cast<std::uint32_t>(pool_.size());
    links.capacity = count;
    pool_.resize(pool_.size() + count);
  }
  links.foundation_count = static_cast<std::uint32_t>(foundations.size());
  links.peer_count = static_cast<std::uint32_t>(peers.size());
  std::copy(foundations.begin(), foundations.end(), pool_.begin() + links.begin);
  std::copy(peers.begin(), peers.end(), pool_.begin() + links.begin + links.foundation_count);
  ++epoch_;
}

// Lists that outgrew their place left holes.
void CellTable::compact_pool() {
  std::vector<std::uint32_t> packed;
  packed.reserve(pool_used_);
  for (Links& links : links_) {
    const auto begin = pool_.begin() + links.begin;
    links.begin = static_cast<std::uint32_t>(packed.size());
    packed.insert(packed.end(), begin, begin + links.capacity);
  }
  pool_.swap(packed);
}

float CellTable::error_at(std::uint32_t cell, std::uint32_t p) const {
  if (p < segment_count(cell)) return errors_[step_index(cell, p + 1)];
  float largest = 0.0F;
  for (std::uint32_t i = 0; i < child_count_[cell]; ++i)
    largest = std::max(largest, errors_[step_index(first_child_[cell] + i, 1)]);
  return largest;
}

std::uint32_t CellTable::held(std::uint32_t cell) const {
  std::uint32_t p = held_[cell];
  const std::uint32_t count = segment_count(cell);
  while (p < count && sizes_bytes_[step_index(cell, p + 1)] == 0) ++p;
  return p;
}

}  // namespace fanstream
