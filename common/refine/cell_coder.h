// One generation of one cell, to symbols and back.
#pragma once

#include <string>

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
  const SplitModel& model;
  const PositionGrid& grid;
  RingGeometry ring;
};

// Source is what knows the splits: for an encoder the builder's history, for a decoder DecodedSplits. It has
//   std::uint32_t split_count(VertexId) and FanSplit split(const RingGeometry&, VertexId root)
// and is told made(const FanSplit&, VertexContext before, VertexId added) of each split, with its ring positions as they
// were applied and the root's context before it.
// `generation` counts from 1. Fails, leaving the mesh valid but useless, if decoded splits leave the grid or outnumber the cell table's.
template <class Coder, class Source>
Result<void> code_generation(FanState& state, CellVertices& vertices, std::uint32_t generation, Coder& coder,
                             Source& source, CellCoding& coding) {
  const glm::vec3 unit = coding.grid.unit();
  const auto mark = static_cast<std::uint8_t>(generation);
  const std::uint32_t count = vertices.count();
  for (std::uint32_t i = 0; i < count; ++i) {
    const VertexId v = vertices.at(i);
    const VertexContext context = state.contexts[v];
    if (context.near_root == mark) continue;  // patches of one generation share no face
    const int table = SymbolContexts::split_count(context.valence, generation - context.touched);
    const std::uint32_t splits =
        detail::code_large(coder, coding.model.symbols[static_cast<std::size_t>(table)], source.split_count(v));
    if (splits == 0) continue;
    if (splits > kMostSplitsPerVertex || splits > vertices.most_new - vertices.made) {
      return fail(ErrorKind::bad_input, "cell " + std::to_string(vertices.cell) + ": vertex " + std::to_string(v) +
                                            " is split more often than the cell table allows");
    }
    for (const VertexId w : state.rings.ring(v)) {
      if (w != kOutside && state.cells[w] == vertices.cell) state.contexts[w].near_root = mark;
    }
    for (std::uint32_t remaining = splits; remaining > 0; --remaining) {
      coding.ring.assign(state.rings.ring(v), v, state.places, unit);
      FanSplit split = source.split(coding.ring, v);
      split.root = v;
      code_split(coder, coding.model, coding.ring, unit, remaining == 1, split);
      const SplitPlaces places = places_after_split(state.places[v], split.parent, split.displacement, generation);
      if (!coding.grid.contains(places.kept) || !coding.grid.contains(places.added)) {
        return fail(ErrorKind::bad_input, "cell " + std::to_string(vertices.cell) + ": the split of vertex " +
                                              std::to_string(v) + " leaves the grid");
      }
      const VertexId added = vertices.first_new + vertices.made++;
      // The ring is applied as stored, which may start elsewhere than the canonical one.
      const std::uint32_t size = coding.ring.size();
      split.first = (split.first + coding.ring.start()) % size;
      split.last = (split.last + coding.ring.start()) % size;
      const VertexContext before = state.contexts[v];
      apply_split(state, vertices.cell, generation, split, added);
      source.made(split, before, added);
    }
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
