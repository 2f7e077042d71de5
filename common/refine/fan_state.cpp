#include "common/refine/fan_state.h"

namespace fanstream {
namespace {

// A free parent's shift takes the rest of a split's note: three times fifteen bits.
constexpr unsigned kShiftBits = 15;
constexpr std::uint32_t kShiftMask = (1U << kShiftBits) - 1U;
static_assert(2 * kMostShift + 1 <= static_cast<std::int32_t>(kShiftMask));
std::uint32_t shift_bits(std::int32_t shift) { return static_cast<std::uint32_t>(shift + kMostShift) & kShiftMask; }
std::int32_t shift_of(std::uint32_t bits) { return static_cast<std::int32_t>(bits & kShiftMask) - kMostShift; }

// Where the parent is shown.
GridPoint place_before_split(const PlacePrecision& precision, const GridPoint& kept, const GridPoint& added,
                             const SplitUndo& undo, std::uint32_t generation) {
  if (precision.is_exact()) return place_after_merge(kept, added, undo.parent, generation, undo.shift);
  const PlaceLattice& lattice = precision.lattice(generation);
  const GridPoint parent =
      place_after_merge(lattice.point_of(kept), lattice.point_of(added), undo.parent, generation, undo.shift);
  const PlaceLattice& before = precision.lattice(undo.root_context.touched);
  return before.code_of(LatticeStep(before, lattice).coarse(parent));
}

}  // namespace

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

FanState FanState::from_base(const BaseMesh& base, std::size_t vertex_count, const PlacePrecision& precision) {
  FanState state;
  state.precision = precision;
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
  if (undo.parent != ParentPosition::free) [[likely]] {
    state.fans.set_note(added, {{{undo.root, undo.root_corner}, {rest, 0}}});
    return;
  }
  const std::uint32_t xy = shift_bits(undo.shift.x) | shift_bits(undo.shift.y) << kShiftBits;
  state.fans.set_note(
      added, {{{undo.root, undo.root_corner}, {rest | xy << 18U, (xy >> 14U) | shift_bits(undo.shift.z) << 16U}}});
}

SplitUndo kept_undo(const FanState& state, VertexId added) {
  const LinkedFans::Note note = state.fans.note(added);
  const std::uint32_t rest = note[1].neighbour;
  const VertexContext context{static_cast<std::uint8_t>(rest), static_cast<std::uint8_t>(rest >> 8U), 0};
  SplitUndo undo{note[0].neighbour, note[0].next, context, static_cast<ParentPosition>(rest >> 16U & 3U), {}};
  if (undo.parent == ParentPosition::free) [[unlikely]] {
    const std::uint32_t xy = rest >> 18U | note[1].next << 14U;
    undo.shift = {shift_of(xy), shift_of(xy >> kShiftBits), shift_of(note[1].next >> 16U)};
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
