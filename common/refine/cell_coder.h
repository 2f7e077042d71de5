// One generation of one cell, to symbols and back.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <span>
#include <string>
#include <vector>

#include "common/coding/split_coder.h"
#include "common/grid/position_grid.h"
#include "common/refine/fan_state.h"
#include "common/support/result.h"

namespace fanstream {

inline constexpr std::uint32_t kMostSplitsPerVertex = 64;  // of one vertex in one generation
inline constexpr std::uint32_t kMostGenerations = 250;

// A cell's vertices in coding order: those it started with, then those it made, numbered onwards from first_new.
struct CellVertices {
  std::uint32_t cell = 0;
  std::vector<VertexId> initial;  // ascending
  VertexId first_new = 0;
  std::uint32_t made = 0;      // so far
  std::uint32_t most_new = 0;  // the cell table's split count

  std::uint32_t count() const { return static_cast<std::uint32_t>(initial.size()) + made; }
  VertexId at(std::uint32_t i) const {
    return i < initial.size() ? initial[i] : first_new + (i - static_cast<std::uint32_t>(initial.size()));
  }
};

// The scratch and constants that coding needs; one per thread of work.
struct CellCoding {
  static constexpr std::size_t kBatch = 16;  // splits that are coded side by side, at most; part of the format
  struct Root {
    VertexId vertex;
    std::uint32_t splits;
  };
  const SplitModel& model;
  const PositionGrid& grid;
  AxisUnits units;
  std::array<SplitInProgress, kBatch> batch;
  std::vector<Root> roots;  // of a generation of a cell, with the splits they still have
  std::vector<std::uint64_t> open;

  CellCoding(const SplitModel& split_model, const PositionGrid& position_grid)
      : model(split_model), grid(position_grid), units(grid.unit()) {}
};

namespace detail {

// Kept out of the way of what is decoded.
[[gnu::cold, gnu::noinline]] Result<void> too_many_splits(std::uint32_t cell);
[[gnu::cold, gnu::noinline]] Result<void> off_the_grid(std::uint32_t cell, VertexId root);

// The vertices of a cell that may still be roots in a generation, in order, as bits by their index in the cell.
class OpenVertices {
 public:
  OpenVertices(std::vector<std::uint64_t>& words, std::uint32_t count) : words_(words) {
    words_.assign((count + 63) / 64, ~std::uint64_t{0});
    if (count % 64 != 0) words_.back() >>= 64 - count % 64;
  }
  void close(std::uint32_t index) { words_[index / 64] &= ~(std::uint64_t{1} << (index % 64)); }
  // Takes the first that is left out and tells it; false if there is none.
  bool take(std::uint32_t& index) {
    for (; at_ < words_.size(); ++at_) {
      std::uint64_t& word = words_[at_];
      if (word == 0) continue;
      index = static_cast<std::uint32_t>(64 * at_) + static_cast<std::uint32_t>(std::countr_zero(word));
      word &= word - 1;
      return true;
    }
    return false;
  }

 private:
  std::vector<std::uint64_t>& words_;
  std::size_t at_ = 0;
};

// Patches of one generation share no face: the neighbours of a root are none. Fans are gone around by eights, which beyond the end
// is around again, since how long they are nobody can tell.
inline void close_neighbours(const FanState& state, std::uint32_t cell, VertexId root, OpenVertices& open) {
  const LinkedFans::Corner* corners = state.fans.corners();
  LinkedFans::CornerId corner = state.fans.corner(root);
  const std::uint32_t own = state.cells[root].index;
  for (std::uint32_t left = state.fans.ring_size(root); left > 0; left = left > 8 ? left - 8 : 0) {
    for (int i = 0; i < 8; ++i) {
      const LinkedFans::Corner c = corners[corner];
      const FanState::CellPlace place = state.cells[c.neighbour == kOutside ? root : c.neighbour];
      open.close(place.cell == cell ? place.index : own);
      corner = c.next;
    }
  }
}

// How often each vertex of the cell is split; fills coding.roots and returns the sum.
template <class Coder, class Source>
std::uint64_t code_roots(const FanState& state, const CellVertices& vertices, std::uint32_t generation, Coder& original,
                         const Source& source, CellCoding& coding) {
  FastCoder<Coder> fast(original);
  OpenVertices open(coding.open, vertices.count());
  coding.roots.clear();
  std::uint64_t sum = 0;
  for (std::uint32_t index = 0; open.take(index);) {
    const VertexId v = vertices.at(index);
    const VertexContext context = state.vertices[v].context;
    const int table = SymbolContexts::split_count(context.valence, generation - context.touched);
    const std::uint32_t splits =
        code_often_zero(fast.coder, coding.model.symbols[static_cast<std::size_t>(table)], source.split_count(v));
    if (splits == 0) continue;
    coding.roots.push_back({v, splits});
    sum += splits;
    close_neighbours(state, vertices.cell, v, open);
  }
  return sum;
}

// The next split of up to kBatch roots.
template <class Coder, class Source>
Result<void> code_batch(FanState& state, CellVertices& vertices, std::uint32_t generation, std::span<CellCoding::Root> roots,
                        Coder& coder, Source& source, CellCoding& coding) {
  const std::span<SplitInProgress> batch = std::span(coding.batch).first(roots.size());
  for (std::size_t i = 0; i < roots.size(); ++i) {
    const VertexId v = roots[i].vertex;
    batch[i].ring.load(state.fans, v);
    batch[i].split.root = v;
    batch[i].last_of_patch = --roots[i].splits == 0;
  }
  for (SplitInProgress& s : batch) s.ring.place(state.vertices, coding.units.size);
  for (SplitInProgress& s : batch) s.ring.measure();
  for (SplitInProgress& s : batch) {
    const VertexId root = s.split.root;
    s.split = source.split(s.ring, root);
    s.split.root = root;
  }
  code_splits(coder, coding.model, coding.units, batch);
  for (SplitInProgress& s : batch) {
    const VertexId v = s.split.root;
    const SplitPlaces places = places_after_split(state.vertices[v].place, s.split.parent, s.split.displacement, generation);
    if (!coding.grid.contains(places.kept) || !coding.grid.contains(places.added)) {
      return off_the_grid(vertices.cell, v);
    }
    const std::uint32_t index = vertices.count();
    const VertexId added = vertices.first_new + vertices.made++;
    const VertexContext before = state.vertices[v].context;
    const LinkedFans::Arc arc{s.ring.corner_before(s.split.first), s.ring.corner(s.split.first),
                              s.ring.corner_before(s.split.last), s.ring.corner(s.split.last)};
    apply_split(state, {vertices.cell, index}, generation, s.split, arc, places, added);
    source.made(s.split, before, added);
  }
  return {};
}

}  // namespace detail

// Source is what knows the splits: for an encoder the builder's history, for a decoder DecodedSplits. It has
//   std::uint32_t split_count(VertexId) and FanSplit split(const RingGeometry&, VertexId root)
// and is told made(const FanSplit&, VertexContext before, VertexId added) of each split, with its canonical ring positions
// and the root's context before it. Splits come in rounds: the first of every root, then the second of those
// that have two, and so on; a root's next one is asked for after the one before was made.
// `generation` counts from 1. Fails, leaving the mesh valid but useless, if decoded splits leave the grid or outnumber the cell table's.
template <class Coder, class Source>
Result<void> code_generation(FanState& state, CellVertices& vertices, std::uint32_t generation, Coder& coder,
                             Source& source, CellCoding& coding) {
  const std::uint64_t splits = detail::code_roots(state, vertices, generation, coder, source, coding);
  std::vector<CellCoding::Root>& roots = coding.roots;
  const bool repeated = std::any_of(roots.begin(), roots.end(), [](const auto& r) { return r.splits > kMostSplitsPerVertex; });
  if (repeated || splits > vertices.most_new - vertices.made) {
    return detail::too_many_splits(vertices.cell);
  }
  while (!roots.empty()) {
    for (std::size_t begin = 0; begin < roots.size(); begin += CellCoding::kBatch) {
      const std::size_t size = std::min(CellCoding::kBatch, roots.size() - begin);
      const std::span<CellCoding::Root> some = std::span(roots).subspan(begin, size);
      if (Result<void> coded = detail::code_batch(state, vertices, generation, some, coder, source, coding); !coded) return coded;
    }
    std::erase_if(roots, [](const CellCoding::Root& r) { return r.splits == 0; });
  }
  return {};
}

// The source of a decoder, which notes what undoing needs.
struct DecodedSplits {
  std::vector<SplitUndo>& undo;

  std::uint32_t split_count(VertexId /*v*/) const { return 0; }
  FanSplit split(const RingGeometry& /*ring*/, VertexId /*root*/) const { return {0, 0, 1, ParentPosition::kept, {}}; }
  void made(const FanSplit& split, VertexContext before, VertexId /*added*/) const {
    undo.push_back({split.root, before, split.parent});
  }
};

}  // namespace fanstream
