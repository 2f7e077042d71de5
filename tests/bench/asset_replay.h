// An asset decoded split by split, generation by generation over all cells, with somebody watching: bookkeeping that a
// client has no need of.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/refine/cell_coder.h"
#include "common/refine/cell_partition.h"
#include "tests/bench/open_asset.h"

namespace fanstream::bench {

// Decodes the generations of each cell up to last_generation[cell], coarse to fine, whether their surroundings are
// ready or not: a caller that leaves out something needed gets other splits or an error. Cells whose parent is not
// complete never start. The observer is told
//   cells_started(first_cell, const std::vector<CellVertices>&, const FanState&)  at the start of each slab,
//   before_split(cell, generation, root, const RingGeometry&)                     the ring as it is decoded against,
//   after_split(cell, generation, root, added).
// Returns the mesh at the end. `asset` has asset_head(), asset_index() and segment() as OpenAsset.
template <class Asset, class Observer>
Result<FanState> replay_asset(const Asset& asset, std::span<const std::uint32_t> last_generation, Observer& observer);

namespace detail {

template <class Observer>
struct WatchedSplits {
  Observer& observer;
  std::uint32_t cell;
  std::uint32_t generation;
  const FanState& state;
  const CellCoding& coding;

  void describe(SplitInProgress& split) const {
    coding.kernels.measure(split.ring, RingPlaces{state.vertices.data(), coding.units.size});
    observer.before_split(cell, generation, split.split.root, split.ring);
  }
  void made(const SplitUndo& split, VertexId added) const { observer.after_split(cell, generation, split.root, added); }
};

// The cells of the first slab, or the children of a slab's complete cells.
inline std::vector<CellVertices> start_cells(const AssetHead& head, const AssetIndex& index, FanState& state,
                                             const std::vector<CellVertices>* parents) {
  std::vector<CellVertices> started;
  const auto start = [&](std::vector<VertexId> vertices, std::uint32_t first, std::uint32_t count) {
    auto groups = partition_vertices(vertices, state.vertices, head.grid.unit(), count);
    for (std::uint32_t i = 0; i < count; ++i) {
      state.set_cell(first + i, groups[i]);
      const CellEntry& entry = index.cells[first + i];
      started.push_back({first + i, std::move(groups[i]), entry.first_vertex, 0, entry.split_count});
    }
  };
  if (parents == nullptr) {
    std::vector<VertexId> all(head.base.places.size());
    for (VertexId v = 0; v < all.size(); ++v) all[v] = v;
    start(std::move(all), 0, head.root_cell_count);
    return started;
  }
  for (const CellVertices& parent : *parents) {
    std::vector<VertexId> vertices(parent.count());
    for (std::uint32_t i = 0; i < vertices.size(); ++i) vertices[i] = parent.at(i);
    start(std::move(vertices), index.cells[parent.cell].first_child, index.cells[parent.cell].child_count);
  }
  return started;
}

}  // namespace detail

template <class Asset, class Observer>
Result<FanState> replay_asset(const Asset& asset, std::span<const std::uint32_t> last_generation, Observer& observer) {
  const AssetHead& head = *asset.asset_head();
  const AssetIndex& index = *asset.asset_index();
  const SplitModel model(head.statistics);
  CellCoding coding(model, head.grid, head.generation_count());
  FanState state = FanState::from_base(head.base, head.vertex_count, head.precision);
  state.set_next_splits(index.base_next_splits);
  std::vector<CellVertices> cells;
  for (std::uint32_t slab = 0; slab < head.slab_ends.size(); ++slab) {
    cells = detail::start_cells(head, index, state, slab == 0 ? nullptr : &cells);
    observer.cells_started(slab, cells, state);
    std::vector<RansDecoder> decoders(cells.size());
    for (std::uint32_t layer = head.layer_begin(slab); layer < head.slab_ends[slab]; ++layer) {
      for (std::uint32_t g = head.first_generation(layer); g <= head.layer_ends[layer]; ++g) {
        for (std::size_t i = 0; i < cells.size(); ++i) {
          const std::uint32_t cell = cells[i].cell;
          const auto bytes = asset.segment(cell, layer - head.layer_begin(slab));
          if (last_generation[cell] < g || index.cells[cell].split_count == 0) continue;
          if (g == head.first_generation(layer))
            decoders[i].append(bytes, index.is_last_coded(index.cells[cell], layer - head.layer_begin(slab)));
          detail::WatchedSplits<Observer> source{observer, cell, g, state, coding};
          find_roots(state, cells[i], g, coding);
          const Result<void> coded = code_generation(state, cells[i], g, decoders[i], source, coding);
          if (!coded) return tl::unexpected(coded.error());
          if (g == head.layer_ends[layer] && !decoders[i].used_up()) {
            return fail(ErrorKind::bad_input, "cell " + std::to_string(cell) + " generation " + std::to_string(g) +
                                                  ": the segment does not end where its splits do");
          }
        }
      }
    }
    const std::uint32_t end = head.layer_ends[head.slab_ends[slab] - 1];
    std::erase_if(cells, [&](const CellVertices& cell) { return last_generation[cell.cell] < end; });
  }
  return state;
}

}  // namespace fanstream::bench
