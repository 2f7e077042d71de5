#include "common/refine/fan_state.h"

namespace fanstream {

void FanState::resize(std::size_t vertex_count, PageKind pages) {
  fans.resize(vertex_count, pages);
  vertices.grow(vertex_count, pages);
  cells.grow(vertex_count, pages);
}

void FanState::note_use(VertexId first, VertexId last) {
  fans.note_use(first, last);
  vertices.note_use(first, last);
  cells.note_use(first, last);
}

void FanState::discard(VertexId first, VertexId last) {
  fans.discard(first, last);
  vertices.discard(first, last);
  cells.discard(first, last);
}

std::size_t FanState::memory_bytes() const {
  return fans.memory_bytes() + vertices.resident_bytes() + cells.resident_bytes();
}

void FanState::set_cell(std::uint32_t cell, std::span<const VertexId> of_cell) {
  for (const VertexId v : of_cell) cells[v] = cell;
}

void FanState::set_next_splits(std::span<const std::uint8_t> of_base) {
  for (VertexId v = 0; v < of_base.size(); ++v) vertices[v].context.next = of_base[v];
}

std::vector<GridPoint> FanState::places() const {
  std::vector<GridPoint> result;
  result.reserve(vertices.size());
  for (const FanVertex& v : vertices) result.push_back(v.place);
  return result;
}

FanState FanState::from_base(const BaseMesh& base, std::size_t vertex_count) {
  FanState state;
  state.fans = LinkedFans(base.places.size(), base.triangles);
  state.resize(vertex_count);
  for (VertexId v = 0; v < base.places.size(); ++v) state.vertices[v] = {base.places[v], {}};
  return state;
}

void apply_split(FanState& state, std::uint32_t cell, std::uint32_t generation, const FanSplit& split,
                 const LinkedFans::Arc& arc, const SplitPlaces& places, NextSplits next, VertexId added) {
  state.fans.split(split.root, added, arc);
  const auto touched = static_cast<std::uint8_t>(generation);
  state.vertices[split.root] = {places.kept, {touched, next.root, 0}};
  state.vertices[added] = {places.added, {touched, next.added, 0}};
  state.cells[added] = cell;
}

void keep_undo(FanState& state, const SplitUndo& undo, VertexId added) {
  const auto rest = undo.root_context.touched | static_cast<std::uint32_t>(undo.root_context.next) << 8U |
                    static_cast<std::uint32_t>(undo.parent) << 16U;
  state.fans.set_note(added, {{{undo.root, undo.root_corner}, {rest, 0}}});
}

SplitUndo kept_undo(const FanState& state, VertexId added) {
  const LinkedFans::Note note = state.fans.note(added);
  const std::uint32_t rest = note[1].neighbour;
  const VertexContext context{static_cast<std::uint8_t>(rest), static_cast<std::uint8_t>(rest >> 8U), 0};
  return {note[0].neighbour, note[0].next, context, static_cast<ParentPosition>(rest >> 16U)};
}

void undo_split(FanState& state, std::uint32_t generation, const SplitUndo& undo, VertexId added) {
  GridPoint& place = state.vertices[undo.root].place;
  place = place_after_merge(place, state.vertices[added].place, undo.parent, generation);
  state.fans.merge(undo.root, added, undo.root_corner);
  state.vertices[undo.root].context = undo.root_context;
  state.vertices[added].context = {};
}

}  // namespace fanstream
