#include "client/view/step_thresholds.h"

#include <algorithm>

namespace fanstream {
namespace {

// Keeps products and quotients of floats finite.
constexpr double kHuge = 1e30;

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

// What the cells of a slab ask of those beside them. Rows are by cell of the slab.
void raise_beside(const CellTable& table, std::uint32_t slab, const float* from, float* to) {
  const std::uint32_t first = table.first_cell(slab);
  const std::uint32_t count = table.cells_of(slab);
  for (std::uint32_t i = 0; i < count; ++i) {
    const float threshold = from[i];
    if (!(threshold > 0.0F)) continue;
    for (const std::uint32_t n : table.peers(first + i)) raise(to[n - first], threshold);
  }
}

// What is applied keeps what it lies on.
void raise_supports(const CellTable& table, std::uint32_t slab, std::uint32_t layer, std::vector<float>& thresholds) {
  const std::uint32_t first = table.first_cell(slab);
  const std::uint32_t row = table.first_step(slab) + layer * table.cells_of(slab);
  for (std::uint32_t i = 0; i < table.cells_of(slab); ++i) {
    const float threshold = thresholds[row + i];
    if (!(threshold > 0.0F)) continue;
    for (const Support& s : table.supports(first + i)) {
      if (s.step == layer + 1) raise(thresholds[table.step_index(s.cell, s.on)], threshold);
    }
  }
}

void raise_foundations(const CellTable& table, std::uint32_t slab, std::vector<float>& thresholds) {
  const std::uint32_t first = table.first_cell(slab);
  for (std::uint32_t i = 0; i < table.cells_of(slab); ++i) {
    const float threshold = thresholds[table.first_step(slab) + i];
    if (!(threshold > 0.0F)) continue;
    for (const std::uint32_t b : table.foundations(first + i))
      raise(thresholds[table.step_index(b, table.segment_count(b))], threshold);
  }
}

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

void ThresholdPass::run(const CellTable& table, const CellScales& scales, float floor, StepThresholds& thresholds) {
  thresholds.begun.resize(table.step_count());
  thresholds.whole.resize(table.joins_generations() ? table.step_count() : 0);
  own_thresholds(table, scales, floor, thresholds.begun);
  for (std::uint32_t slab = table.slab_count(); slab-- > 0;) {
    const std::uint32_t count = table.cells_of(slab);
    for (std::uint32_t layer = table.layers_of(slab); layer-- > 0;) {
      float* row = thresholds.begun.data() + table.first_step(slab) + layer * count;
      if (!thresholds.whole.empty())
        std::copy_n(row, count, thresholds.whole.data() + table.first_step(slab) + layer * count);
      // Generation by generation down to the first of the layer.
      for (std::uint32_t g = table.layer_generations(slab, layer); g > 1; --g) {
        before_.assign(row, row + count);
        raise_beside(table, slab, before_.data(), row);
      }
      raise_supports(table, slab, layer, thresholds.begun);
      if (layer > 0) {
        for (std::uint32_t i = 0; i < count; ++i) raise((row - count)[i], row[i]);
        raise_beside(table, slab, row, row - count);
      }
    }
    raise_foundations(table, slab, thresholds.begun);
  }
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
