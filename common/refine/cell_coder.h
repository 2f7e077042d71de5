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
  // Both are part of the format: splits, and vertices that may be split, that are coded side by side at most.
  static constexpr std::size_t kBatch = 16;
  static constexpr std::size_t kRootGroup = 4;
  struct Root {
    VertexId vertex = 0;
    std::uint32_t splits = 0;
    FanWalk walk;  // before its first split
  };
  const SplitModel& model;
  const PositionGrid& grid;
  AxisUnits units;
  std::array<SplitInProgress, kBatch> batch;
  std::vector<Root> roots;  // of a generation of a cell, with the splits they still have: the first root_count
  std::size_t root_count = 0;
  std::vector<std::uint8_t> closed;  // by index in the cell: no root in this generation

  CellCoding(const SplitModel& split_model, const PositionGrid& position_grid)
      : model(split_model), grid(position_grid), units(grid.unit()) {}
};

namespace detail {

// Kept out of the way of what is decoded.
[[gnu::cold, gnu::noinline]] Result<void> too_many_splits(std::uint32_t cell);
[[gnu::cold, gnu::noinline]] Result<void> neighbours_split(std::uint32_t cell);
[[gnu::cold, gnu::noinline]] Result<void> off_the_grid(std::uint32_t cell, VertexId root);

// Patches of one generation share no face: no neighbour of a root is one. Returns whether one is all the same: closed
// before, by a root that was not known yet when it was coded itself, or split in a cell next door. Only damaged data do
// that.
inline std::uint8_t close_neighbours(const FanState& state, std::uint32_t cell, std::uint32_t generation, VertexId root,
                                     const FanWalk& walk, std::vector<std::uint8_t>& closed) {
  const std::uint32_t own = state.cells[root].index;
  std::uint8_t clashes = closed[own];
  const auto close = [&](VertexId neighbour) {
    const VertexId w = neighbour == kOutside ? root : neighbour;
    const FanState::CellPlace place = state.cells[w];
    closed[place.cell == cell ? place.index : own] = 1;  // to close the root itself does no harm
    clashes |= state.vertices[w].context.touched == generation ? 1 : 0;
  };
  if (walk.size > FanWalk::kEntries) {
    state.fans.for_each_neighbour(root, close);
    return clashes;
  }
  for (std::size_t i = 0; i < 8; ++i) close(walk.ids[i]);
  if (walk.size > 8) {
    for (std::size_t i = 8; i < FanWalk::kEntries; ++i) close(walk.ids[i]);
  }
  return clashes;
}

struct RootsFound {
  std::uint64_t splits = 0;     // of all roots together
  bool are_neighbours = false;  // two of the roots
};

// How often each vertex of the cell is split, by groups of kRootGroup vertices that are not closed; fills coding.roots.
// What a root closes is known from the next group but one on: a decoder then waits for nothing but symbols.
template <class Coder, class Source>
RootsFound code_roots(const FanState& state, const CellVertices& vertices, std::uint32_t generation, Coder& original,
                      const Source& source, CellCoding& coding) {
  FastCoder<Coder> fast(original);
  const std::uint32_t count = vertices.count();
  coding.closed.assign(count, 0);
  std::array<std::uint32_t, CellCoding::kRootGroup + 1> group;
  std::uint32_t at = 0;
  const auto next_group = [&] {
    std::size_t size = 0;
    for (; size < CellCoding::kRootGroup && at < count; ++at) {
      group[size] = at;
      size += coding.closed[at] == 0 ? 1 : 0;
    }
    return size;
  };
  RootsFound found;
  std::uint8_t clashes = 0;
  std::size_t roots = 0;
  for (std::size_t size = next_group(); size != 0;) {
    if (coding.roots.size() < roots + CellCoding::kRootGroup) coding.roots.resize(2 * (roots + CellCoding::kRootGroup));
    const std::size_t before = roots;
    for (std::size_t i = 0; i < size; ++i) {
      const VertexId v = vertices.at(group[i]);
      const VertexContext context = state.vertices[v].context;
      const int table = SymbolContexts::split_count(context.valence, generation - context.touched);
      const std::uint32_t splits =
          code_large(fast.coder, coding.model.symbols[static_cast<std::size_t>(table)], source.split_count(v));
      // Whether it is a root or not: while symbols wait for each other, there is time.
      coding.roots[roots].walk.go_around(state.fans, v);
      coding.roots[roots].vertex = v;
      coding.roots[roots].splits = splits;
      roots += splits != 0 ? 1 : 0;
      found.splits += splits;
    }
    size = next_group();
    for (std::size_t i = before; i < roots; ++i) {
      clashes |= close_neighbours(state, vertices.cell, generation, coding.roots[i].vertex, coding.roots[i].walk,
                                  coding.closed);
    }
  }
  coding.root_count = roots;
  found.are_neighbours = clashes != 0;
  return found;
}

// The next split of up to kBatch roots.
template <class Coder, class Source>
Result<void> code_batch(FanState& state, CellVertices& vertices, std::uint32_t generation,
                        std::span<CellCoding::Root> roots, bool first_round, Coder& coder, Source& source,
                        CellCoding& coding) {
  const std::span<SplitInProgress> batch = std::span(coding.batch).first(roots.size());
  for (std::size_t i = 0; i < roots.size(); ++i) {
    const VertexId v = roots[i].vertex;
    if (first_round) {
      batch[i].ring.load(state.fans, v, roots[i].walk);
    } else {
      batch[i].ring.load(state.fans, v);
    }
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
    const SplitPlaces places =
        places_after_split(state.vertices[v].place, s.split.parent, s.split.displacement, generation);
    if (!coding.grid.contains(places.kept) || !coding.grid.contains(places.added)) {
      return off_the_grid(vertices.cell, v);
    }
    const std::uint32_t index = vertices.count();
    const VertexId added = vertices.first_new + vertices.made++;
    const SplitUndo undo{v, state.fans.corner(v), state.vertices[v].context, s.split.parent};
    const LinkedFans::Arc arc{s.ring.corner_before(s.split.first), s.ring.corner(s.split.first),
                              s.ring.corner_before(s.split.last), s.ring.corner(s.split.last)};
    apply_split(state, {vertices.cell, index}, generation, s.split, arc, places, added);
    source.made(undo, added);
  }
  return {};
}

}  // namespace detail

// Source is what knows the splits: for an encoder the builder's history, for a decoder DecodedSplits. It has
//   std::uint32_t split_count(VertexId) and FanSplit split(const RingGeometry&, VertexId root)
// and is told made(const SplitUndo&, VertexId added) of each split. Splits come in rounds: the first of every root,
// then the second of those that have two, and so on; a root's next one is asked for after the one before was made.
// `generation` counts from 1. Fails, leaving the mesh valid but useless, if decoded splits leave the grid, outnumber
// the cell table's or have roots that are neighbours.
template <class Coder, class Source>
Result<void> code_generation(FanState& state, CellVertices& vertices, std::uint32_t generation, Coder& coder,
                             Source& source, CellCoding& coding) {
  const detail::RootsFound found = detail::code_roots(state, vertices, generation, coder, source, coding);
  std::span<CellCoding::Root> roots = std::span(coding.roots).first(coding.root_count);
  const bool repeated =
      std::any_of(roots.begin(), roots.end(), [](const auto& r) { return r.splits > kMostSplitsPerVertex; });
  if (repeated || found.splits > vertices.most_new - vertices.made) return detail::too_many_splits(vertices.cell);
  if (found.are_neighbours) return detail::neighbours_split(vertices.cell);  // a batch would split faces that are gone
  for (std::uint32_t round = 0; !roots.empty(); ++round) {
    for (std::size_t begin = 0; begin < roots.size(); begin += CellCoding::kBatch) {
      const std::size_t size = std::min(CellCoding::kBatch, roots.size() - begin);
      const std::span<CellCoding::Root> some = roots.subspan(begin, size);
      if (Result<void> coded = detail::code_batch(state, vertices, generation, some, round == 0, coder, source, coding);
          !coded)
        return coded;
    }
    std::size_t left = 0;  // the walks are of no more use
    for (const CellCoding::Root& r : roots) {
      roots[left].vertex = r.vertex;
      roots[left].splits = r.splits;
      left += r.splits != 0 ? 1 : 0;
    }
    roots = roots.first(left);
  }
  return {};
}

// The source of a decoder, which notes what undoing needs.
struct DecodedSplits {
  std::vector<SplitUndo>& undo;

  std::uint32_t split_count(VertexId /*v*/) const { return 0; }
  FanSplit split(const RingGeometry& /*ring*/, VertexId /*root*/) const { return {0, 0, 1, ParentPosition::kept, {}}; }
  void made(const SplitUndo& made, VertexId /*added*/) const { undo.push_back(made); }
};

}  // namespace fanstream
