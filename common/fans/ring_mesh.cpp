#include "common/fans/ring_mesh.h"

#include <algorithm>
#include <array>
#include <cassert>

#include "common/support/vector4.h"

namespace fanstream {

RingMesh RingMesh::from_triangles(std::size_t vertex_count, const std::vector<Triangle>& triangles) {
  RingMesh mesh;
  std::vector<std::uint32_t> first_corner(vertex_count + 1, 0);
  for (const Triangle& t : triangles) {
    for (const VertexId v : t) ++first_corner[v + 1];
  }
  for (std::size_t v = 0; v < vertex_count; ++v) first_corner[v + 1] += first_corner[v];
  struct Edge {
    VertexId from, to;
  };
  std::vector<Edge> opposite(triangles.size() * 3);  // per vertex, the edges opposite to it in its faces
  {
    std::vector<std::uint32_t> fill(first_corner.begin(), first_corner.end() - 1);
    for (const Triangle& t : triangles) {
      for (int c = 0; c < 3; ++c) opposite[fill[t[c]]++] = {t[(c + 1) % 3], t[(c + 2) % 3]};
    }
  }
  mesh.slots_.resize(vertex_count);
  std::vector<VertexId> ring;
  for (std::size_t v = 0; v < vertex_count; ++v) {
    const std::span<Edge> edges(opposite.data() + first_corner[v], first_corner[v + 1] - first_corner[v]);
    if (edges.empty()) continue;
    // An open fan starts at the edge whose first vertex no other edge ends at.
    for (Edge& edge : edges) {
      const bool preceded = std::any_of(edges.begin(), edges.end(), [&](const Edge& e) { return e.to == edge.from; });
      if (!preceded) {
        std::swap(edges.front(), edge);
        break;
      }
    }
    ring.assign(1, edges.front().from);
    VertexId next = edges.front().to;
    for (std::size_t i = 1; i < edges.size(); ++i) {
      ring.push_back(next);
      const auto follow = std::find_if(edges.begin() + i, edges.end(), [&](const Edge& e) { return e.from == next; });
      assert(follow != edges.end());
      std::swap(edges[i], *follow);
      next = edges[i].to;
    }
    if (next != ring.front()) {
      ring.push_back(next);
      ring.push_back(kOutside);
    }
    mesh.set_ring(static_cast<VertexId>(v), ring);
  }
  return mesh;
}

bool RingMesh::is_boundary(VertexId v) const { return position_in_ring(v, kOutside) != ring_size(v); }

std::uint32_t RingMesh::position_in_ring(VertexId v, VertexId neighbour) const {
  const std::span<const VertexId> r = ring(v);
  std::uint32_t i = 0;
  while (i < r.size() && r[i] != neighbour) ++i;
  return i;
}

void RingMesh::set_ring(VertexId v, std::span<const VertexId> ring) {
  Slot& slot = slots_[v];
  const bool was_long = slot.count > kShort;
  const bool is_long = ring.size() > kShort;
  if (was_long && !is_long) {
    long_rings_[slot.ids[0]] = {};
    free_long_rings_.push_back(slot.ids[0]);
  } else if (is_long && !was_long) {
    if (free_long_rings_.empty()) {
      free_long_rings_.push_back(static_cast<std::uint32_t>(long_rings_.size()));
      long_rings_.emplace_back();
    }
    slot.ids[0] = free_long_rings_.back();
    free_long_rings_.pop_back();
  }
  slot.count = static_cast<std::uint32_t>(ring.size());
  if (is_long) {
    long_rings_[slot.ids[0]].assign(ring.begin(), ring.end());
  } else {
    std::copy(ring.begin(), ring.end(), slot.ids.begin());
  }
}

namespace {

// A slot is worked on as sixteen lanes: its ids, then its count. That has no branches that depend on the ring.
constexpr std::size_t kBlocks = 4;

void copy_lanes(std::uint32_t* to, const std::uint32_t* from) {
  const Uint4 a = load4(from);
  const Uint4 b = load4(from + 4);
  const Uint4 c = load4(from + 8);
  const Uint4 d = load4(from + 12);
  store4(to, a);
  store4(to + 4, b);
  store4(to + 8, c);
  store4(to + 12, d);
}

// Puts `added` before or after `neighbour`, which must be there, among the first `blocks` times four lanes.
template <std::size_t blocks>
void insert_lanes(std::uint32_t* lanes, std::uint32_t count, VertexId neighbour, bool after, VertexId added) {
  std::array<Uint4, blocks> old;
  std::array<Uint4, blocks> before;  // each lane's left neighbour
  Uint4 found{};
  for (std::size_t k = 0; k < blocks; ++k) {
    const Uint4 lane = kLaneNumbers + uint4(static_cast<std::uint32_t>(4 * k));
    old[k] = load4(lanes + 4 * k);
    before[k] = k == 0 ? __builtin_shufflevector(old[0], old[0], 0, 0, 1, 2) : __builtin_shufflevector(old[k - 1], old[k], 3, 4, 5, 6);
    found |= mask_of(old[k] == uint4(neighbour)) & less(lane, uint4(count)) & lane;
  }
  const std::uint32_t at = any_bits(found) + (after ? 1U : 0U);
  for (std::size_t k = 0; k < blocks; ++k) {
    const Uint4 lane = kLaneNumbers + uint4(static_cast<std::uint32_t>(4 * k));
    const Uint4 moved = chosen(mask_of(lane == uint4(at)), uint4(added), before[k]);
    store4(lanes + 4 * k, chosen(less(lane, uint4(at)), old[k], moved));
  }
}

}  // namespace

void RingMesh::insert_beside(VertexId v, VertexId neighbour, bool after, VertexId added) {
  Slot& slot = slots_[v];
  const std::uint32_t count = slot.count;
  if (count < 8) {
    insert_lanes<2>(slot.lanes(), count, neighbour, after, added);
    slot.count = count + 1;
  } else if (count < kShort) {
    insert_lanes<kBlocks>(slot.lanes(), count, neighbour, after, added);
    slot.count = count + 1;
  } else {
    const std::span<const VertexId> old = ring(v);
    std::vector<VertexId> longer(old.begin(), old.end());
    longer.insert(longer.begin() + position_in_ring(v, neighbour) + (after ? 1 : 0), added);
    set_ring(v, longer);
  }
}

void RingMesh::remove_from_ring(VertexId v, VertexId removed) {
  const std::uint32_t position = position_in_ring(v, removed);
  Slot& slot = slots_[v];
  if (slot.count <= kShort) {
    std::copy(slot.ids.data() + position + 1, slot.ids.data() + slot.count, slot.ids.data() + position);
    --slot.count;
    return;
  }
  const std::span<const VertexId> old = ring(v);
  std::vector<VertexId> shorter(old.begin(), old.end());
  shorter.erase(shorter.begin() + position);
  set_ring(v, shorter);
}

void RingMesh::replace_in_ring(VertexId v, VertexId from, VertexId to) {
  Slot& slot = slots_[v];
  if (slot.count > kShort) {
    std::vector<VertexId>& ring = long_rings_[slot.ids[0]];
    *std::find(ring.begin(), ring.end(), from) = to;
    return;
  }
  const std::uint32_t count = slot.count;
  for (std::size_t k = 0; k < (count <= 8 ? 2 : kBlocks); ++k) {
    std::uint32_t* lanes = slot.lanes() + 4 * k;
    const Uint4 old = load4(lanes);
    store4(lanes, chosen(mask_of(old == uint4(from)), uint4(to), old));
  }
  slot.count = count;  // which may have looked like `from`
}

void RingMesh::split(VertexId root, VertexId added, std::uint32_t first, std::uint32_t last) {
  const std::span<const VertexId> once = ring(root);
  std::vector<VertexId> twice(2 * once.size() + 16);
  std::copy(once.begin(), once.end(), twice.begin());
  std::copy(once.begin(), once.end(), twice.begin() + static_cast<std::ptrdiff_t>(once.size()));
  split(root, added, twice.data(), static_cast<std::uint32_t>(once.size()), first, last);
}

void RingMesh::split(VertexId root, VertexId added, const VertexId* ring_twice, std::uint32_t size, std::uint32_t first,
                     std::uint32_t last) {
  assert(size == slots_[root].count && first < size && last < size && first != last);
  if (added >= slots_.size()) slots_.resize(added + 1);
  assert(slots_[added].count == 0);
  const std::uint32_t taken = last > first ? last - first : last + size - first;  // ring steps from wing to wing
  const VertexId* arc = ring_twice + first;   // both parts are straight runs
  const VertexId* rest = ring_twice + last;
  if (size < kShort) {
    Slot& root_slot = slots_[root];
    Slot& added_slot = slots_[added];
    copy_lanes(added_slot.lanes(), arc);
    copy_lanes(root_slot.lanes(), rest);
    added_slot.ids[taken + 1] = root;
    added_slot.count = taken + 2;
    root_slot.ids[size - taken + 1] = added;
    root_slot.count = size - taken + 2;
  } else {
    std::vector<VertexId> part(arc, arc + taken + 1);
    part.push_back(root);
    set_ring(added, part);
    part.assign(rest, rest + (size - taken) + 1);
    part.push_back(added);
    set_ring(root, part);
  }
  for (std::uint32_t i = 1; i < taken; ++i) {
    if (arc[i] != kOutside) replace_in_ring(arc[i], root, added);
  }
  if (arc[0] != kOutside) insert_beside(arc[0], root, false, added);
  if (arc[taken] != kOutside) insert_beside(arc[taken], root, true, added);
}

RingMesh::Wings RingMesh::wings(VertexId root, VertexId removed) const {
  const std::span<const VertexId> r = ring(removed);
  const std::uint32_t at = position_in_ring(removed, root);
  const auto size = static_cast<std::uint32_t>(r.size());
  return {r[(at + 1) % size], r[(at + size - 1) % size]};
}

void RingMesh::merge(VertexId root, VertexId removed) {
  const std::span<const VertexId> kept = ring(root);
  const std::span<const VertexId> taken = ring(removed);
  const std::uint32_t in_kept = position_in_ring(root, removed);
  const std::uint32_t in_taken = position_in_ring(removed, root);
  // The root's ring from the last wing on to the first, then what the removed one had between the wings.
  std::array<VertexId, 2 * kShort> few;
  std::vector<VertexId> many;
  const std::size_t size = kept.size() + taken.size() - 4;
  if (size > few.size()) many.resize(size);
  VertexId* merged = size > few.size() ? many.data() : few.data();
  VertexId* end = std::copy(kept.begin() + in_kept + 1, kept.end(), merged);
  end = std::copy(kept.begin(), kept.begin() + in_kept, end);
  const VertexId wing_last = merged[0];
  const VertexId wing_first = end[-1];
  const auto interior = static_cast<std::uint32_t>(taken.size() - 3);
  for (std::uint32_t i = 0, at = in_taken; i < interior + 1; ++i) {
    at = at + 1 == taken.size() ? 0 : at + 1;
    if (i > 0) *end++ = taken[at];
  }
  set_ring(root, {merged, size});
  for (std::uint32_t i = 0; i < interior; ++i) {
    const VertexId w = merged[size - interior + i];
    if (w != kOutside) replace_in_ring(w, removed, root);
  }
  if (wing_first != kOutside) remove_from_ring(wing_first, removed);
  if (wing_last != kOutside) remove_from_ring(wing_last, removed);
  set_ring(removed, {});
}

bool RingMesh::can_merge(VertexId root, VertexId removed) const {
  const std::span<const VertexId> a = ring(root);
  const std::span<const VertexId> b = ring(removed);
  if (position_in_ring(root, removed) == a.size()) return false;
  if (a.size() + b.size() - 4 < 3) return false;  // a tetrahedron, or a lone triangle, would fold onto itself
  std::uint32_t common = 0;
  for (const VertexId w : b) {
    common += static_cast<std::uint32_t>(std::find(a.begin(), a.end(), w) != a.end());
  }
  if (common != 2) return false;
  const Wings w = wings(root, removed);
  if (w.first == kOutside && w.last == kOutside) return false;
  return (w.first == kOutside || ring_size(w.first) > 3) && (w.last == kOutside || ring_size(w.last) > 3);
}

std::vector<Triangle> RingMesh::triangles() const {
  std::size_t corners = 0;
  for (const Slot& slot : slots_) corners += slot.count;
  std::vector<Triangle> result(corners / 3 + 1);
  // Every corner's face is written, but only that of its smallest vertex is kept, and rings are gone through by eights: how long
  // they are and which of their vertices are smaller nobody can tell, so there are no branches on it.
  Triangle* next = result.data();
  const auto put = [&next](VertexId v, VertexId b, VertexId c, bool exists) {
    *next = {v, b, c};
    next += static_cast<int>(exists) & static_cast<int>(v < b) & static_cast<int>(v < c) & static_cast<int>(b != kOutside) &
            static_cast<int>(c != kOutside);
  };
  for (VertexId v = 0; v < slots_.size(); ++v) {
    const std::span<const VertexId> r = ring(v);
    if (r.empty()) continue;
    VertexId b = r.back();
    if (r.size() <= 8) {
      for (std::size_t i = 0; i < 8; ++i) {
        put(v, b, r.data()[i], i < r.size());
        b = r.data()[i];
      }
    } else {
      for (const VertexId c : r) {
        put(v, b, c, true);
        b = c;
      }
    }
  }
  result.resize(static_cast<std::size_t>(next - result.data()));
  return result;
}

std::size_t RingMesh::memory_bytes() const {
  std::size_t bytes = slots_.capacity() * sizeof(Slot) + long_rings_.capacity() * sizeof(std::vector<VertexId>) +
                      free_long_rings_.capacity() * sizeof(std::uint32_t);
  for (const auto& ring : long_rings_) bytes += ring.capacity() * sizeof(VertexId);
  return bytes;
}

void RingMesh::reserve(std::size_t vertex_count) { slots_.reserve(vertex_count); }

}  // namespace fanstream
