#include "client/view/step_thresholds.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace fanstream {
namespace {

// Keeps products and quotients of floats finite.
constexpr double kHuge = 1e30;
constexpr std::uint32_t kBlockCells = 64;

// A step's is that of its last generation; others have none of their own. `scales` are of `count` cells from `first`
// on.
void own_thresholds(const CellTable& table, std::uint32_t first, std::uint32_t count, const CellScales& scales,
                    float floor, StepThresholds& thresholds) {
  const float near = scales.near;
  const std::uint32_t slab = table.slab_of(first);
  for (std::uint32_t layer = 0; layer < table.layers_of(slab); ++layer) {
    const float* errors = table.errors().data() + table.step_index(first, layer + 1);
    float* out = thresholds.values.data() + (thresholds.whole_rows[table.first_layer(slab) + layer] + first);
    for (std::uint32_t i = 0; i < count; ++i) {
      const float e = errors[i];
      const float distance = std::max(near, std::max(scales.depth[i] - e, scales.slant[i] - 2.0F * e));
      const float px = std::min(static_cast<float>(kHuge), scales.scale[i] * e / distance);
      out[i] = px > floor ? px : 0.0F;
    }
  }
}

// Without a branch, as it cannot be foreseen.
void raise(float& threshold, float to) { threshold = std::max(threshold, to); }

}  // namespace

void StepThresholds::resize(const CellTable& table) {
  begun_rows.clear();
  whole_rows.clear();
  std::uint32_t size = 0;
  for (std::uint32_t slab = 0; slab < table.slab_count(); ++slab) {
    for (std::uint32_t layer = 0; layer < table.layers_of(slab); ++layer) {
      begun_rows.push_back(size - table.first_cell(slab));
      size += table.layer_generations(slab, layer) * table.cells_of(slab);
      whole_rows.push_back(size - table.cells_of(slab) - table.first_cell(slab));
    }
  }
  values.resize(size);
}

void CellScales::resize(std::size_t cells) {
  scale.resize(cells);
  depth.resize(cells);
  slant.resize(cells);
}

void CellScales::set(std::size_t i, const ProjectedError& error, double weight) {
  scale[i] = static_cast<float>(std::min(kHuge, weight * error.scale_px));
  depth[i] = static_cast<float>(std::clamp(error.depth, -kHuge, kHuge));
  slant[i] = static_cast<float>(std::clamp(error.slant, -kHuge, kHuge));
  near = static_cast<float>(std::clamp(error.near, 1.0 / kHuge, kHuge));
}

// Where each generation's thresholds stand: by slab, generation and cell. If that is new, so is all that is packed.
void ThresholdPass::place_generations() {
  rows_before_.swap(rows_);
  rows_.clear();
  first_row_.clear();
  std::uint32_t size = 0;
  for (std::uint32_t slab = 0; slab < table_.slab_count(); ++slab) {
    first_row_.push_back(static_cast<std::uint32_t>(rows_.size()));
    for (std::uint32_t g = 0; g < table_.generations_of(slab); ++g, size += table_.cells_of(slab))
      rows_.push_back(size - table_.first_cell(slab));
  }
  if (rows_ == rows_before_) return;
  blocks_.clear();
  first_block_.clear();
  packed_epoch_ = 0;
  for (std::uint32_t slab = 0; slab < table_.slab_count(); ++slab) {
    first_block_.push_back(static_cast<std::uint32_t>(blocks_.size()));
    const std::uint32_t end = table_.first_cell(slab) + table_.cells_of(slab);
    for (std::uint32_t cell = table_.first_cell(slab); cell < end; cell += kBlockCells) {
      blocks_.push_back({slab, cell, std::min(kBlockCells, end - cell), {}, {}});
      blocks_.back().edge_end.assign(table_.generations_of(slab) + 1, 0);
    }
  }
  first_block_.push_back(static_cast<std::uint32_t>(blocks_.size()));
}

void ThresholdPass::pack_changed() {
  if (table_.dependency_epoch() == packed_epoch_) return;
  for (Block& block : blocks_) {
    std::uint64_t newest = 0;
    for (std::uint32_t i = 0; i < block.cell_count; ++i)
      newest = std::max(newest, table_.dependency_epoch(block.first_cell + i));
    if (newest > packed_epoch_) pack(block);
  }
  packed_epoch_ = table_.dependency_epoch();
}

void ThresholdPass::pack(Block& block) {
  const std::uint32_t end = block.first_cell + block.cell_count;
  const std::uint32_t generations = table_.generations_of(block.slab);
  const auto for_each_edge = [&](const auto& f) {
    for (std::uint32_t cell = block.first_cell; cell < end; ++cell) {
      for (const Dependency& d : table_.needs(cell)) f(cell, d);
      for (const Dependency& d : table_.supports(cell)) f(cell, d);
    }
  };
  // A counting sort: counts become begins, and begins ends.
  std::vector<std::uint32_t>& ends = block.edge_end;
  std::fill(ends.begin(), ends.end(), 0);
  for_each_edge([&](std::uint32_t, const Dependency& d) { ++ends[d.generation - 1]; });
  std::uint32_t count = 0;
  for (std::uint32_t g = generations; g > 0; --g) count += std::exchange(ends[g - 1], count);
  if (count > block.edges.capacity()) {
    std::vector<Edge>().swap(block.edges);
    block.edges.reserve(count + count / 8);
  }
  block.edges.resize(count);
  for_each_edge([&](std::uint32_t cell, const Dependency& d) {
    block.edges[ends[d.generation - 1]++] = {place(block.slab, cell, d.generation),
                                             place(table_.slab_of(d.cell), d.cell, d.on)};
  });
}

// What the cells' generation asks of the one before and of others.
void ThresholdPass::raise_by(std::uint32_t slab, std::uint32_t generation, float* thresholds) const {
  for (std::uint32_t b = first_block_[slab]; b < first_block_[slab + 1]; ++b) {
    const Block& block = blocks_[b];
    const float* row = thresholds + place(slab, block.first_cell, generation);
    // Thresholds are not negative: any bits are of one that is above 0.
    std::uint32_t any = 0;
    for (std::uint32_t i = 0; i < block.cell_count; ++i) any |= std::bit_cast<std::uint32_t>(row[i]);
    if (any == 0) continue;
    if (generation > 1) {
      float* before = thresholds + place(slab, block.first_cell, generation - 1);
      for (std::uint32_t i = 0; i < block.cell_count; ++i) before[i] = std::max(before[i], row[i]);
    } else if (slab > 0) {
      const std::uint32_t last = rows_[first_row_[slab] - 1];
      for (std::uint32_t i = 0; i < block.cell_count; ++i)
        raise(thresholds[last + table_.parent(block.first_cell + i)], row[i]);
    }
    const Edge* const end = block.edges.data() + block.edge_end[generation - 1];
    for (const Edge* e = block.edges.data() + block.edge_end[generation]; e != end; ++e)
      raise(thresholds[e->to], thresholds[e->from]);
  }
}

void ThresholdPass::run(const ScalesOf& scales_of, float floor, StepThresholds& thresholds) {
  place_generations();
  pack_changed();
  thresholds.resize(table_);
  if (table_.joins_generations()) std::fill(thresholds.values.begin(), thresholds.values.end(), 0.0F);
  for (const Block& block : blocks_) {
    scales_of(block.first_cell, block.cell_count, scales_);
    own_thresholds(table_, block.first_cell, block.cell_count, scales_, floor, thresholds);
  }
  for (std::uint32_t slab = table_.slab_count(); slab-- > 0;) {
    for (std::uint32_t g = table_.generations_of(slab); g > 0; --g) raise_by(slab, g, thresholds.values.data());
  }
}

void count_steps_above(const CellTable& table, const StepThresholds& thresholds, std::span<const std::uint32_t> rows,
                       float level, float factor, std::vector<std::uint8_t>& counts) {
  counts.assign(table.cell_count(), 0);
  for (std::uint32_t slab = 0; slab < table.slab_count(); ++slab) {
    const std::uint32_t cells = table.cells_of(slab);
    std::uint8_t* out = counts.data() + table.first_cell(slab);
    for (std::uint32_t layer = 0; layer < table.layers_of(slab); ++layer) {
      const float* row = thresholds.values.data() + (rows[table.first_layer(slab) + layer] + table.first_cell(slab));
      for (std::uint32_t i = 0; i < cells; ++i) out[i] = static_cast<std::uint8_t>(out[i] + (row[i] * factor > level));
    }
  }
}

}  // namespace fanstream
