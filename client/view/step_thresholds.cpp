#include "client/view/step_thresholds.h"

#include <algorithm>

namespace fanstream {
namespace {

// Keeps products and quotients of floats finite.
constexpr double kHuge = 1e30;
constexpr std::uint32_t kNotYet = 0xFFFFFFFFU;  // no generation of the cell has a threshold so far

void own_thresholds(const CellTable& table, const CellScales& scales, float floor, std::vector<float>& thresholds) {
  const float near = scales.near;
  for (std::uint32_t slab = 0; slab < table.slab_count(); ++slab) {
    const std::uint32_t count = table.cells_of(slab);
    const float* scale = scales.scale.data() + table.first_cell(slab);
    const float* depth = scales.depth.data() + table.first_cell(slab);
    const float* slant = scales.slant.data() + table.first_cell(slab);
    for (std::uint32_t layer = 0; layer < table.layers_of(slab); ++layer) {
      const std::uint32_t row = table.first_step(slab) + layer * count;
      const float* errors = table.errors().data() + row;
      float* out = thresholds.data() + row;
      for (std::uint32_t i = 0; i < count; ++i) {
        const float e = errors[i];
        const float distance = std::max(near, std::max(depth[i] - e, slant[i] - 2.0F * e));
        const float px = std::min(static_cast<float>(kHuge), scale[i] * e / distance);
        out[i] = px > floor ? px : 0.0F;
      }
    }
  }
}

void raise(float& threshold, float to) { threshold = std::max(threshold, to); }

}  // namespace

void CellScales::resize(std::size_t cells) {
  scale.resize(cells);
  depth.resize(cells);
  slant.resize(cells);
}

void CellScales::set(std::uint32_t cell, const ProjectedError& error, double weight) {
  scale[cell] = static_cast<float>(std::min(kHuge, weight * error.scale_px));
  depth[cell] = static_cast<float>(std::clamp(error.depth, -kHuge, kHuge));
  slant[cell] = static_cast<float>(std::clamp(error.slant, -kHuge, kHuge));
  near = static_cast<float>(std::clamp(error.near, 1.0 / kHuge, kHuge));
}

// What the cells' generation asks of the one before and of others.
void ThresholdPass::raise_by(const CellTable& table, std::uint32_t slab, std::uint32_t generation) {
  const std::uint32_t count = table.cells_of(slab);
  const float* row = generations_.data() + slab_begin_[slab] + std::size_t{generation - 1} * count;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t cell = table.first_cell(slab) + i;
    const float threshold = row[i];
    if (!(threshold > 0.0F)) continue;  // nor had it in a finer one
    const auto raise_all = [&](std::span<const Dependency> list, std::uint32_t& next) {
      if (next == kNotYet) next = static_cast<std::uint32_t>(CellTable::first_up_to(list, generation));
      for (; next < list.size() && list[next].generation == generation; ++next) {
        raise(at(table.slab_of(list[next].cell), list[next].cell, list[next].on), threshold);
      }
    };
    raise_all(table.needs(cell), next_need_[cell]);
    raise_all(table.supports(cell), next_support_[cell]);
    if (generation > 1) {
      raise(at(slab, cell, generation - 1), threshold);
    } else if (const std::uint32_t parent = table.parent(cell); parent != CellTable::kNoCell) {
      raise(at(slab - 1, parent, table.generations_of(slab - 1)), threshold);
    }
  }
}

void ThresholdPass::run(const CellTable& table, const CellScales& scales, float floor, StepThresholds& thresholds) {
  thresholds.begun.resize(table.step_count());
  thresholds.whole.resize(table.joins_generations() ? table.step_count() : 0);
  own_thresholds(table, scales, floor, thresholds.begun);
  slab_begin_.clear();
  first_row_.clear();
  rows_.clear();
  std::size_t size = 0;
  for (std::uint32_t slab = 0; slab < table.slab_count(); ++slab) {
    slab_begin_.push_back(size);
    first_row_.push_back(rows_.size());
    for (std::uint32_t g = 0; g < table.generations_of(slab); ++g, size += table.cells_of(slab))
      rows_.push_back(size - table.first_cell(slab));
  }
  generations_.assign(size, 0.0F);
  next_need_.assign(table.cell_count(), kNotYet);
  next_support_.assign(table.cell_count(), kNotYet);
  // Row by row: steps, and the last generations that they ask for.
  const auto for_each_row = [&](const auto& f) {
    for (std::uint32_t slab = 0; slab < table.slab_count(); ++slab) {
      const std::uint32_t count = table.cells_of(slab);
      std::size_t first = slab_begin_[slab];
      for (std::uint32_t layer = 0; layer < table.layers_of(slab); ++layer) {
        const std::size_t last = first + std::size_t{table.layer_generations(slab, layer) - 1} * count;
        f(table.first_step(slab) + layer * count, first, last, count);
        first = last + count;
      }
    }
  };
  for_each_row([&](std::size_t steps, std::size_t, std::size_t last, std::uint32_t count) {
    std::copy_n(thresholds.begun.data() + steps, count, generations_.data() + last);
  });
  for (std::uint32_t slab = table.slab_count(); slab-- > 0;) {
    for (std::uint32_t g = table.generations_of(slab); g > 0; --g) raise_by(table, slab, g);
  }
  for_each_row([&](std::size_t steps, std::size_t first, std::size_t last, std::uint32_t count) {
    std::copy_n(generations_.data() + first, count, thresholds.begun.data() + steps);
    if (!thresholds.whole.empty()) std::copy_n(generations_.data() + last, count, thresholds.whole.data() + steps);
  });
}

void count_steps_above(const CellTable& table, std::span<const float> thresholds, float level, float factor,
                       std::vector<std::uint8_t>& counts) {
  counts.assign(table.cell_count(), 0);
  for (std::uint32_t slab = 0; slab < table.slab_count(); ++slab) {
    const std::uint32_t cells = table.cells_of(slab);
    std::uint8_t* out = counts.data() + table.first_cell(slab);
    for (std::uint32_t layer = 0; layer < table.layers_of(slab); ++layer) {
      const float* row = thresholds.data() + table.first_step(slab) + layer * cells;
      for (std::uint32_t i = 0; i < cells; ++i) out[i] = static_cast<std::uint8_t>(out[i] + (row[i] * factor > level));
    }
  }
}

}  // namespace fanstream
