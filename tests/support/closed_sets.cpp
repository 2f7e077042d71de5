#include "tests/support/closed_sets.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/bench/asset_replay.h"

namespace fanstream::testing {
namespace {

// As replay_asset wants it.
struct ReplayedAsset {
  const OpenAsset& asset;

  std::shared_ptr<const AssetHead> asset_head() const { return asset.head; }
  std::shared_ptr<const AssetIndex> asset_index() const { return asset.index; }
  std::span<const std::byte> segment(std::uint32_t cell, std::uint32_t number) const {
    return asset.segment(cell, number);
  }
};

}  // namespace

struct ClosedSets::Recorder {
  std::vector<Cell>& cells;
  std::vector<Step> latest;  // by vertex

  void cells_started(std::uint32_t /*slab*/, const std::vector<CellVertices>& /*cells*/, const FanState& /*state*/) {}

  void before_split(std::uint32_t cell, std::uint32_t generation, VertexId root, const RingGeometry& ring) {
    std::vector<Step>& needs = cells[cell].needs[generation - cells[cell].begin - 1];
    const auto need = [&](VertexId v) {
      const Step step = latest[v];
      if (step.generation == 0 || step.cell == cell || std::find(needs.begin(), needs.end(), step) != needs.end())
        return;
      needs.push_back(step);
    };
    need(root);
    for (std::uint32_t i = 0; i < ring.size(); ++i) {
      if (ring.id(i) != kOutside) need(ring.id(i));
    }
  }

  void after_split(std::uint32_t cell, std::uint32_t generation, VertexId root, VertexId added) {
    latest[root] = latest[added] = {cell, generation};
    ++cells[cell].splits[generation - cells[cell].begin - 1];
  }
};

ClosedSets::ClosedSets(const OpenAsset& asset) : asset_(asset), cells_(asset.index->cells.size()) {
  const AssetHead& head = *asset.head;
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    const std::uint32_t slab = asset.index->cells[c].slab;
    cells_[c].begin = slab == 0 ? 0 : head.layer_ends[head.slab_ends[slab - 1] - 1];
    cells_[c].end = head.layer_ends[head.slab_ends[slab] - 1];
    cells_[c].needs.resize(cells_[c].end - cells_[c].begin);
    cells_[c].splits.resize(cells_[c].end - cells_[c].begin);
  }
  Recorder recorder{cells_, std::vector<Step>(head.vertex_count)};
  const std::vector<std::uint32_t> everything(cells_.size(), head.generation_count());
  const auto replayed = bench::replay_asset(ReplayedAsset{asset}, everything, recorder);
  EXPECT_TRUE(replayed) << replayed.error().message;
}

std::vector<std::uint32_t> ClosedSets::largest(std::span<const std::uint32_t> prefixes) const {
  const AssetHead& head = *asset_.head;
  std::vector<std::uint32_t> done(cells_.size());
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    const CellEntry& entry = asset_.index->cells[c];
    const std::uint32_t layer =
        head.layer_begin(entry.slab) + std::min<std::uint32_t>(prefixes[c], entry.segment_count);
    done[c] = layer == 0 ? 0 : head.layer_ends[layer - 1];
  }
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t c = 0; c < cells_.size(); ++c) {
      const Cell& cell = cells_[c];
      const CellEntry& entry = asset_.index->cells[c];
      std::uint32_t most = cell.begin;
      if (entry.slab > 0 && done[entry.parent] < cells_[entry.parent].end) {
        most = 0;
      } else {
        const auto allowed = [&](const Step& step) { return done[step.cell] >= step.generation; };
        while (most < done[c] &&
               std::all_of(cell.needs[most - cell.begin].begin(), cell.needs[most - cell.begin].end(), allowed)) {
          ++most;
        }
      }
      changed |= most != done[c];
      done[c] = most;
    }
  }
  return done;
}

std::uint32_t ClosedSets::vertex_count(std::span<const std::uint32_t> generations) const {
  auto count = static_cast<std::uint32_t>(asset_.head->base.places.size());
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    for (std::uint32_t g = cells_[c].begin; g < generations[c]; ++g) count += cells_[c].splits[g - cells_[c].begin];
  }
  return count;
}

}  // namespace fanstream::testing
