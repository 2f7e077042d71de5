#include "common/fans/ring_mesh.h"

#include <algorithm>
#include <cassert>
#include <cstring>

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
  mesh.pool_.reserve(vertex_count * 8);
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
    const auto count = static_cast<std::uint32_t>(ring.size());
    mesh.slots_[v] = {mesh.allocate(count), count};
    std::copy(ring.begin(), ring.end(), mesh.pool_.begin() + mesh.slots_[v].offset);
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

std::uint32_t RingMesh::allocate(std::uint32_t count) {
  const std::uint32_t sized = size_class(count);
  if (sized < free_.size() && !free_[sized].empty()) {
    const std::uint32_t offset = free_[sized].back();
    free_[sized].pop_back();
    return offset;
  }
  const auto offset = static_cast<std::uint32_t>(pool_.size());
  pool_.resize(pool_.size() + sized * 4);
  return offset;
}

void RingMesh::release(std::uint32_t offset, std::uint32_t count) {
  const std::uint32_t sized = size_class(count);
  if (sized >= free_.size()) free_.resize(sized + 1);
  free_[sized].push_back(offset);
}

// Keeps the first entries that fit.
void RingMesh::resize_ring(VertexId v, std::uint32_t count) {
  Slot& slot = slots_[v];
  if (size_class(slot.count) != size_class(count)) {
    const std::uint32_t offset = allocate(count);
    std::memcpy(pool_.data() + offset, pool_.data() + slot.offset, std::min(slot.count, count) * sizeof(VertexId));
    release(slot.offset, slot.count);
    slot.offset = offset;
  }
  slot.count = count;
}

void RingMesh::insert_in_ring(VertexId v, std::uint32_t position, VertexId added) {
  resize_ring(v, slots_[v].count + 1);
  VertexId* r = pool_.data() + slots_[v].offset;
  std::memmove(r + position + 1, r + position, (slots_[v].count - 1 - position) * sizeof(VertexId));
  r[position] = added;
}

void RingMesh::remove_from_ring(VertexId v, VertexId removed) {
  const std::uint32_t position = position_in_ring(v, removed);
  VertexId* r = pool_.data() + slots_[v].offset;
  std::memmove(r + position, r + position + 1, (slots_[v].count - 1 - position) * sizeof(VertexId));
  resize_ring(v, slots_[v].count - 1);
}

void RingMesh::replace_in_ring(VertexId v, VertexId from, VertexId to) {
  VertexId* r = pool_.data() + slots_[v].offset;
  while (*r != from) ++r;
  *r = to;
}

void RingMesh::split(VertexId root, VertexId added, std::uint32_t first, std::uint32_t last) {
  const std::uint32_t size = slots_[root].count;
  assert(first < size && last < size && first != last);
  const std::uint32_t taken = (last + size - first) % size;  // ring steps from the first wing to the last
  if (added >= slots_.size()) slots_.resize(added + 1);
  assert(slots_[added].count == 0);
  const std::uint32_t offset = allocate(taken + 2);
  slots_[added] = {offset, taken + 2};
  VertexId* added_ring = pool_.data() + offset;
  VertexId* root_ring = pool_.data() + slots_[root].offset;
  for (std::uint32_t i = 0, at = first; i <= taken; ++i) {
    added_ring[i] = root_ring[at];
    if (++at == size) at = 0;
  }
  added_ring[taken + 1] = root;
  // The root keeps [last .. first] and gains the new vertex in place of the arc's interior.
  if (first < last) {
    if (taken == 1) {
      insert_in_ring(root, last, added);
    } else {
      std::memmove(root_ring + first + 2, root_ring + last, (size - last) * sizeof(VertexId));
      root_ring[first + 1] = added;
      resize_ring(root, size - taken + 2);
    }
  } else {
    std::memmove(root_ring, root_ring + last, (first - last + 1) * sizeof(VertexId));
    resize_ring(root, size - taken + 2);
    pool_[slots_[root].offset + slots_[root].count - 1] = added;
  }
  for (std::uint32_t i = 1; i < taken; ++i) {
    const VertexId w = pool_[offset + i];
    if (w != kOutside) replace_in_ring(w, root, added);
  }
  const VertexId wing_first = pool_[offset];
  const VertexId wing_last = pool_[offset + taken];
  if (wing_first != kOutside) insert_in_ring(wing_first, position_in_ring(wing_first, root), added);
  if (wing_last != kOutside) insert_in_ring(wing_last, position_in_ring(wing_last, root) + 1, added);
}

RingMesh::Wings RingMesh::wings(VertexId root, VertexId removed) const {
  const std::span<const VertexId> r = ring(removed);
  const std::uint32_t at = position_in_ring(removed, root);
  const auto size = static_cast<std::uint32_t>(r.size());
  return {r[(at + 1) % size], r[(at + size - 1) % size]};
}

void RingMesh::merge(VertexId root, VertexId removed) {
  const std::uint32_t removed_size = slots_[removed].count;
  const std::uint32_t removed_offset = slots_[removed].offset;
  const std::uint32_t at = position_in_ring(removed, root);
  const std::uint32_t interior = removed_size - 3;
  const auto around = [&](std::uint32_t i) { return pool_[removed_offset + (at + i) % removed_size]; };
  const VertexId wing_first = around(1);
  const VertexId wing_last = around(removed_size - 1);
  for (std::uint32_t i = 2; i + 1 < removed_size; ++i) {
    if (around(i) != kOutside) replace_in_ring(around(i), removed, root);
  }
  if (wing_first != kOutside) remove_from_ring(wing_first, removed);
  if (wing_last != kOutside) remove_from_ring(wing_last, removed);
  const std::uint32_t gap = position_in_ring(root, removed);
  const std::uint32_t old_size = slots_[root].count;
  const std::uint32_t new_size = old_size - 1 + interior;
  if (new_size >= old_size) resize_ring(root, new_size);
  VertexId* root_ring = pool_.data() + slots_[root].offset;
  std::memmove(root_ring + gap + interior, root_ring + gap + 1, (old_size - gap - 1) * sizeof(VertexId));
  for (std::uint32_t i = 0; i < interior; ++i) root_ring[gap + i] = around(2 + i);
  if (new_size < old_size) resize_ring(root, new_size);
  release(removed_offset, removed_size);
  slots_[removed] = {};
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
  std::vector<Triangle> result;
  result.reserve(slots_.size() * 2);
  for (VertexId v = 0; v < slots_.size(); ++v) {
    const std::span<const VertexId> r = ring(v);
    for (std::size_t i = 0, n = r.size(); i < n; ++i) {
      const VertexId b = r[i];
      const VertexId c = r[i + 1 == n ? 0 : i + 1];
      if (v < b && v < c && b != kOutside && c != kOutside) result.push_back({v, b, c});
    }
  }
  return result;
}

std::size_t RingMesh::memory_bytes() const {
  std::size_t bytes = slots_.capacity() * sizeof(Slot) + pool_.capacity() * sizeof(VertexId);
  for (const auto& list : free_) bytes += list.capacity() * sizeof(std::uint32_t);
  return bytes;
}

void RingMesh::reserve(std::size_t vertex_count) {
  slots_.reserve(vertex_count);
  pool_.reserve(vertex_count * 8);
}

}  // namespace fanstream
