#include "common/refine/fan_state.h"

namespace fanstream {

void FanState::resize(std::size_t vertex_count) {
  rings.reserve(vertex_count);
  places.resize(vertex_count);
  contexts.resize(vertex_count);
  cells.resize(vertex_count);
}

void apply_split(FanState& state, std::uint32_t cell, std::uint32_t generation, const FanSplit& split, VertexId added) {
  const auto ring = state.rings.ring(split.root);
  for (const VertexId wing : {ring[split.first], ring[split.last]}) {
    if (wing == kOutside || state.cells[wing] != cell) continue;
    VertexContext& context = state.contexts[wing];
    ++context.valence;  // wraps, so that it can be undone
  }
  state.rings.split(split.root, added, split.first, split.last);
  const SplitPlaces places = places_after_split(state.places[split.root], split.parent, split.displacement, generation);
  state.places[split.root] = places.kept;
  state.places[added] = places.added;
  state.cells[added] = cell;
  for (const VertexId v : {split.root, added}) {
    state.contexts[v].valence = static_cast<std::uint8_t>(state.rings.ring_size(v));
    state.contexts[v].touched = static_cast<std::uint8_t>(generation);
  }
}

void undo_split(FanState& state, std::uint32_t cell, std::uint32_t generation, const SplitUndo& undo, VertexId added) {
  const GridPoint kept = state.places[undo.root];
  state.places[undo.root] = place_after_merge(kept, state.places[added], undo.parent, generation);
  const RingMesh::Wings wings = state.rings.wings(undo.root, added);
  state.rings.merge(undo.root, added);
  for (const VertexId wing : {wings.first, wings.last}) {
    if (wing != kOutside && state.cells[wing] == cell) --state.contexts[wing].valence;
  }
  state.contexts[undo.root] = undo.root_context;
  state.contexts[added] = {};
}

}  // namespace fanstream
