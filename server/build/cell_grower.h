// Cells as they grow while a history is replayed, slab by slab: what training and encoding share.
#pragma once

#include <algorithm>
#include <cmath>

#include "common/refine/cell_partition.h"
#include "server/build/coded_history.h"

namespace fanstream {

// Replays a history from FM0 in coding order. Keeps references to its arguments.
class CellGrower {
 public:
  CellGrower(const AssetHead& head, const CodedHistory& coded, const std::vector<VertexId>& base_numbers,
             double cell_vertices)
      : head_(head),
        coded_(coded),
        cell_vertices_(cell_vertices),
        source_(coded, base_numbers, head.vertex_count),
        state_(FanState::from_base(head.base, head.vertex_count, head.precision)) {
    next_vertex_ = static_cast<std::uint32_t>(head.base.places.size());
    state_.set_next_splits(source_.next_splits_of_base());
  }

  static std::uint32_t parts_for(std::size_t vertices, double cell_vertices) {
    return static_cast<std::uint32_t>(std::max(1.0, std::floor(static_cast<double>(vertices) / cell_vertices + 0.5)));
  }

  // Replays everything. `coder(cell)` gives the coder of a cell; `hook` sees each split's ring before it is coded;
  // `end_layer(layer, cell)` is called for each cell when a layer is through.
  template <class Coder, class Hook, class EndLayer>
  Result<void> replay(const SplitModel& model, Coder&& coder, Hook&& hook, EndLayer&& end_layer) {
    CellCoding coding(model, head_.grid, head_.generation_count());
    for (std::uint32_t slab = 0; slab < head_.slab_ends.size(); ++slab) {
      start_slab(slab);
      for (std::uint32_t layer = head_.layer_begin(slab); layer < head_.slab_ends[slab]; ++layer) {
        for (std::uint32_t g = head_.first_generation(layer); g <= head_.layer_ends[layer]; ++g) {
          HookedSource<Hook> source{source_, hook};
          for (std::uint32_t c = slab_first_; c < cells_.size(); ++c) {
            if (cells_[c].split_count == 0) continue;
            find_roots(state_, growing_[c - slab_first_], g, coding);
            Result<void> coded = code_generation(state_, growing_[c - slab_first_], g, coder(c), source, coding);
            if (!coded) return coded;
          }
        }
        for (std::uint32_t c = slab_first_; c < cells_.size(); ++c) end_layer(layer, c);
      }
    }
    return {};
  }

  const std::vector<CellEntry>& cells() const { return cells_; }
  const FanState& state() const { return state_; }
  VertexId original(VertexId v) const { return source_.original(v); }  // the model's vertex of a coded number
  std::vector<std::uint8_t> next_splits_of_base() const { return source_.next_splits_of_base(); }  // before replay()

 private:
  template <class Hook>
  struct HookedSource {
    HistorySource& source;
    Hook& hook;
    void describe(SplitInProgress& split) const {
      const MergeRecord& merge = source.merge_of(split.split.root);
      source.describe(split);
      hook(split.ring, split.split, merge);
    }
    LowBits root_low_bits(VertexId root) const { return source.root_low_bits(root); }
    void made(const SplitUndo& split, VertexId added) { source.made(split, added); }
  };

  void start_slab(std::uint32_t slab) {
    const auto first = static_cast<std::uint32_t>(cells_.size());
    std::vector<CellVertices> started;
    const auto add = [&](std::vector<VertexId> vertices, std::uint32_t parts, std::uint32_t parent) {
      for (auto& group : partition_vertices(vertices, state_.vertices, head_.grid.unit(), parts)) {
        const auto number = static_cast<std::uint32_t>(cells_.size());
        state_.set_cell(number, group);
        CellEntry entry;
        entry.parent = parent;
        entry.slab = slab;
        cells_.push_back(entry);
        started.push_back({number, std::move(group), 0, 0, 0});
      }
    };
    if (slab == 0) {
      std::vector<VertexId> all(head_.base.places.size());
      for (VertexId v = 0; v < all.size(); ++v) all[v] = v;
      add(std::move(all), head_.root_cell_count, 0xFFFFFFFFU);
    } else {
      for (std::uint32_t p = slab_first_; p < first; ++p) {
        const CellVertices& parent = growing_[p - slab_first_];
        std::vector<VertexId> vertices(parent.count());
        for (std::uint32_t i = 0; i < vertices.size(); ++i) vertices[i] = parent.at(i);
        cells_[p].first_child = static_cast<std::uint32_t>(cells_.size());
        cells_[p].child_count = parts_for(vertices.size(), cell_vertices_);
        add(std::move(vertices), cells_[p].child_count, p);
      }
    }
    growing_ = std::move(started);
    slab_first_ = first;
    count_splits(slab);
  }

  // How many splits each cell of the slab will make: every vertex stays in the cell of the root it is split from.
  void count_splits(std::uint32_t slab) {
    std::vector<std::uint32_t> cell_of(coded_.base_places.size(), 0);
    for (const CellVertices& cell : growing_) {
      for (const VertexId v : cell.initial) cell_of[source_.original(v)] = cell.cell;
    }
    const std::uint32_t first = head_.first_generation(head_.layer_begin(slab));
    const std::uint32_t last = head_.layer_ends[head_.slab_ends[slab] - 1];
    for (std::uint32_t g = first; g <= last; ++g) {
      for (std::uint32_t m = coded_.generation_end(g); m-- > coded_.generation_begin(g);) {
        const MergeRecord& merge = coded_.history.merges[m];
        cell_of[merge.removed] = cell_of[merge.root];
        ++cells_[cell_of[merge.root]].split_count;
      }
    }
    for (CellVertices& cell : growing_) {
      CellEntry& entry = cells_[cell.cell];
      entry.first_vertex = next_vertex_;
      next_vertex_ += entry.split_count;
      cell.first_new = entry.first_vertex;
      cell.most_new = entry.split_count;
    }
  }

  const AssetHead& head_;
  const CodedHistory& coded_;
  double cell_vertices_;
  HistorySource source_;
  FanState state_;
  std::vector<CellEntry> cells_;
  std::vector<CellVertices> growing_;  // of the current slab
  std::uint32_t slab_first_ = 0;
  VertexId next_vertex_ = 0;
};

}  // namespace fanstream
