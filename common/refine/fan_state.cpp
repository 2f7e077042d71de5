#include "common/refine/fan_state.h"

namespace fanstream {

void FanState::resize(std::size_t vertex_count) {
  rings.reserve(vertex_count);
  vertices.resize(vertex_count);
  cells.resize(vertex_count);
  near_root.resize(vertex_count);
}

std::vector<GridPoint> FanState::places() const {
  std::vector<GridPoint> result;
  result.reserve(vertices.size());
  for (const FanVertex& v : vertices) result.push_back(v.place);
  return result;
}

FanState FanState::from_base(const BaseMesh& base, std::size_t vertex_count) {
  FanState state;
  state.rings = RingMesh::from_triangles(base.places.size(), base.triangles);
  state.resize(vertex_count);
  for (VertexId v = 0; v < base.places.size(); ++v) {
    state.vertices[v].place = base.places[v];
    state.vertices[v].context.valence = static_cast<std::uint8_t>(state.rings.ring_size(v));
  }
  return state;
}

namespace {

// A wing gains a neighbour; that counts for its context if it is of the same cell. Wraps, so that it can be undone.
void count_wing(FanState& state, std::uint32_t cell, VertexId wing, int added) {
  if (wing == kOutside || state.cells[wing] != cell) return;
  std::uint8_t& valence = state.vertices[wing].context.valence;
  valence = static_cast<std::uint8_t>(valence + added);
}

}  // namespace

void apply_split(FanState& state, std::uint32_t cell, std::uint32_t generation, const FanSplit& split,
                 const VertexId* ring_twice, std::uint32_t ring_size, const SplitPlaces& places, VertexId added) {
  count_wing(state, cell, ring_twice[split.first], 1);
  count_wing(state, cell, ring_twice[split.last], 1);
  state.rings.split(split.root, added, ring_twice, ring_size, split.first, split.last);
  const auto touched = static_cast<std::uint8_t>(generation);
  const auto vertex = [&](const GridPoint& place, VertexId v) {
    return FanVertex{place, {static_cast<std::uint8_t>(state.rings.ring_size(v)), touched, 0}};
  };
  state.vertices[split.root] = vertex(places.kept, split.root);
  state.vertices[added] = vertex(places.added, added);
  state.cells[added] = cell;
}

void undo_split(FanState& state, std::uint32_t cell, std::uint32_t generation, const SplitUndo& undo, VertexId added) {
  GridPoint& place = state.vertices[undo.root].place;
  place = place_after_merge(place, state.vertices[added].place, undo.parent, generation);
  const RingMesh::Wings wings = state.rings.wings(undo.root, added);
  state.rings.merge(undo.root, added);
  count_wing(state, cell, wings.first, -1);
  count_wing(state, cell, wings.last, -1);
  state.vertices[undo.root].context = undo.root_context;
  state.vertices[added].context = {};
}

}  // namespace fanstream
