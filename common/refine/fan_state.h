// The mesh while it is refined and coarsened, and what coding remembers of each vertex.
#pragma once

#include <cstdint>
#include <vector>

#include "common/coding/base_coder.h"
#include "common/coding/fan_vertex.h"
#include "common/coding/place_precision.h"
#include "common/fans/linked_fans.h"
#include "common/refine/vertex_slots.h"
#include "common/support/paged_array.h"

namespace fanstream {

// Arrays by vertex number. Thread safety: like a standard container.
struct FanState {
  LinkedFans fans;
  PagedArray<FanVertex> vertices;   // place, and what is known of its splits
  PagedArray<std::uint32_t> cells;  // the deepest cell that holds the vertex
  PlacePrecision precision;         // of the places
  VertexSlots slots;                // of vertices that splits bring

  // Room that no vertex uses takes no memory, huge pages aside. With small pages vertices that splits bring get the
  // lowest free numbers (take_slot), with huge ones those of the asset.
  void resize(std::size_t vertex_count, PageKind pages = PageKind::huge);
  // Where numbers are handed out: one that is free.
  VertexId take_slot() {
    const VertexId v = slots.take();
    if (slots.is_alone(v)) note_use(slots.group(v));
    return v;
  }
  // Asks for the memory of a vertex and its fan.
  void fetch(VertexId v) const {
    fetch_line(vertices.data() + v);
    fans.fetch(v);
  }
  // Gives back the memory of numbers that have become free.
  void give_back_pages();
  VertexId vertex_end() const {  // beyond all that are in the mesh, perhaps beyond the capacity
    return slots.in_use() ? slots.end() : static_cast<VertexId>(fans.vertex_capacity());
  }
  std::size_t memory_bytes() const;
  void set_cell(std::uint32_t cell, std::span<const VertexId> vertices);
  std::vector<GridPoint> places() const;
  // The base mesh, with the places that are shown of it, no vertex split yet, in no cell; room for vertex_count
  // vertices.
  static FanState from_base(const BaseMesh& base, std::size_t vertex_count, const PlacePrecision& precision = {});
  void set_next_splits(std::span<const std::uint8_t> of_base);  // FM0's vertices', by number

 private:
  void note_use(VertexSlots::Range range);
};

// When the two vertices of a split are split next.
struct NextSplits {
  std::uint8_t root = kNeverSplit;
  std::uint8_t added = kNeverSplit;
};

// Applies a split of a vertex of `cell`, whose arc is that of split.first and split.last. `generation` counts from 1,
// `places` are those after the split.
inline void apply_split(FanState& state, std::uint32_t cell, std::uint32_t generation, VertexId root,
                        const LinkedFans::Arc& arc, const SplitLanes& places, NextSplits next, VertexId added) {
  state.fans.split(root, added, arc);
  FanVertex* const vertices = state.vertices.data();
  vertices[root].set(places.kept, VertexContext::word_of(generation, next.root));
  vertices[added].set(places.added, VertexContext::word_of(generation, next.added));
  state.cells[added] = cell;
}

// What the exact inverse of a split needs to know beyond the mesh.
struct SplitUndo {
  VertexId root = 0;
  LinkedFans::CornerId root_corner = 0;  // where its fan started
  VertexContext root_context;
  ParentPosition parent = ParentPosition::kept;
  GridPoint shift{0};  // of a free parent
};
namespace kept_shift {

// A free parent's shift takes the rest of a split's note: three times fifteen bits.
inline constexpr unsigned kBits = 15;
inline constexpr std::uint32_t kMask = (1U << kBits) - 1U;
static_assert(2 * kMostShift + 1 <= static_cast<std::int32_t>(kMask));
inline std::uint32_t bits(std::int32_t shift) { return static_cast<std::uint32_t>(shift + kMostShift) & kMask; }
inline std::int32_t shift_of(std::uint32_t kept) { return static_cast<std::int32_t>(kept & kMask) - kMostShift; }

}  // namespace kept_shift

// Kept in the mesh, with the vertex that the split made.
inline void keep_undo(FanState& state, const SplitUndo& undo, VertexId added) {
  const std::uint32_t rest = undo.root_context.word() | static_cast<std::uint32_t>(undo.parent) << 16U;
  if (undo.parent != ParentPosition::free) [[likely]] {
    state.fans.set_note(added, {{{undo.root, undo.root_corner}, {rest, 0}}});
    return;
  }
  const std::uint32_t xy = kept_shift::bits(undo.shift.x) | kept_shift::bits(undo.shift.y) << kept_shift::kBits;
  state.fans.set_note(added, {{{undo.root, undo.root_corner},
                               {rest | xy << 18U, (xy >> 14U) | kept_shift::bits(undo.shift.z) << 16U}}});
}
SplitUndo kept_undo(const FanState& state, VertexId added);
// Precondition: the split that made `added` is the latest of its surroundings.
void undo_split(FanState& state, std::uint32_t generation, const SplitUndo& undo, VertexId added);

}  // namespace fanstream
