// The vertices of a cell, in the order in which they are coded.
#pragma once

#include <algorithm>
#include <cstdint>

#include "common/refine/fan_state.h"
#include "common/support/compact_list.h"

namespace fanstream {

// Those it started with, then those it made: numbered onwards from first_new, as the asset has it, or with numbers of
// the state's own where that hands them out.
struct CellVertices {
  std::uint32_t cell = 0;
  CompactList<VertexId> initial;  // ascending in the asset's numbers
  VertexId first_new = 0;
  std::uint32_t made = 0;         // so far
  std::uint32_t most_new = 0;     // the cell table's split count
  CompactList<VertexId> slots{};  // of those made; empty where they have the asset's numbers

  // Asks for the memory of the lists.
  void fetch() const {
    fetch_lines(initial.data(), initial.size() * sizeof(VertexId));
    fetch_lines(slots.data(), slots.size() * sizeof(VertexId));
  }
  // And for that of the vertices.
  void fetch_vertices(const FanState& state) const {
    for (const VertexId v : initial) state.fetch(v);
    for (std::uint32_t i = 0; i < made; ++i) state.fetch(made_at(i));
  }
  std::uint32_t count() const { return initial.size() + made; }
  VertexId at(std::uint32_t i) const { return i < initial.size() ? initial[i] : made_at(i - initial.size()); }
  VertexId made_at(std::uint32_t i) const { return slots.empty() ? first_new + i : slots[i]; }
  // For so many more, and where there are more to come for some of these.
  void make_room(const FanState& state, std::uint32_t count) {
    constexpr std::uint32_t kAtLeast = 64;
    if (state.slots.in_use()) slots.reserve(std::min(most_new, made + std::max(count, kAtLeast)));
  }
  // The number of the next vertex that the cell makes.
  VertexId add(FanState& state) {
    const VertexId in_asset = first_new + made++;
    if (!state.slots.in_use()) return in_asset;
    slots.push_back(state.take_slot());
    return slots.back();
  }
  // Forgets the last one, which is not in the mesh any more.
  void remove_last(FanState& state) {
    --made;
    if (slots.empty()) return;
    state.slots.give_back(slots.back());
    slots.pop_back();
  }
};

}  // namespace fanstream
