#include "common/refine/fan_state.h"

#include <algorithm>

namespace fanstream {
namespace {

// Where the parent is shown.
GridPoint place_before_split(const PlacePrecision& precision, const GridPoint& kept, const GridPoint& added,
                             const SplitUndo& undo, std::uint32_t generation) {
  if (precision.is_exact()) return place_after_merge(kept, added, undo.parent, generation, undo.shift);
  const PlaceLattice& lattice = precision.lattice(generation);
  const GridPoint parent =
      place_after_merge(lattice.point_of(kept), lattice.point_of(added), undo.parent, generation, undo.shift);
  const PlaceLattice& before = precision.known(undo.root_context.touched, generation);
  return before.code_of(LatticeStep(before, lattice).coarse(parent));
}

}  // namespace

void FanState::resize(std::size_t vertex_count, PageKind pages) {
  const std::size_t base = fans.vertex_capacity();
  fans.resize(vertex_count, pages);
  vertices.grow(vertex_count, pages);
  cells.grow(vertex_count, pages);
  if (pages == PageKind::small && !slots.in_use()) slots = VertexSlots(static_cast<VertexId>(base));
}

void FanState::note_use(VertexSlots::Range range) {
  const VertexId last = std::min(range.last, static_cast<VertexId>(fans.vertex_capacity()));
  fans.note_use(range.first, last);
  vertices.note_use(range.first, last);
  cells.note_use(range.first, last);
}

void FanState::give_back_pages() {
  for (const VertexSlots::Range range : slots.take_emptied()) {
    const VertexId last = std::min(range.last, static_cast<VertexId>(fans.vertex_capacity()));
    fans.discard(range.first, last);
    vertices.discard(range.first, last);
    cells.discard(range.first, last);
  }
}

std::size_t FanState::memory_bytes() const {
  return fans.memory_bytes() + vertices.resident_bytes() + cells.resident_bytes() + slots.memory_bytes();
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

FanState FanState::from_base(const BaseMesh& base, std::size_t vertex_count, const PlacePrecision& precision) {
  FanState state;
  state.precision = precision;
  state.fans = LinkedFans(base.places.size(), base.triangles);
  state.resize(vertex_count);
  for (VertexId v = 0; v < base.places.size(); ++v) state.vertices[v] = {base.places[v], {}};
  return state;
}

SplitUndo kept_undo(const FanState& state, VertexId added) {
  const LinkedFans::Note note = state.fans.note(added);
  const std::uint32_t rest = note[1].neighbour;
  SplitUndo undo{
      note[0].neighbour, note[0].next, VertexContext::of_word(rest), static_cast<ParentPosition>(rest >> 16U & 3U), {}};
  if (undo.parent == ParentPosition::free) [[unlikely]] {
    const std::uint32_t xy = rest >> 18U | note[1].next << 14U;
    undo.shift = {kept_shift::shift_of(xy), kept_shift::shift_of(xy >> kept_shift::kBits),
                  kept_shift::shift_of(note[1].next >> 16U)};
  }
  return undo;
}

void undo_split(FanState& state, std::uint32_t generation, const SplitUndo& undo, VertexId added) {
  GridPoint& place = state.vertices[undo.root].place;
  place = place_before_split(state.precision, place, state.vertices[added].place, undo, generation);
  state.fans.merge(undo.root, added, undo.root_corner);
  state.vertices[undo.root].context = undo.root_context;
  state.vertices[added].context = {};
}

}  // namespace fanstream
