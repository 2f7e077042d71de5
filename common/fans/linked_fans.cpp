#include "common/fans/linked_fans.h"

#include <algorithm>
#include <cassert>
#include <numeric>
#include <span>
#include <utility>

namespace fanstream {
namespace {

using CornerId = LinkedFans::CornerId;

// Corners by the directed edge that leaves them on its left: edges by where they start, sorted by where they lead.
class CornersByEdge {
 public:
  // `corners` three to a face, in groups of four.
  CornersByEdge(std::size_t vertex_count, std::span<const LinkedFans::Corner> corners)
      : begin_(vertex_count + 2), edges_(corners.size() / 4 * 3) {
    const auto for_each_edge = [&](auto&& look) {
      for (CornerId corner = 0; corner < corners.size(); ++corner) {
        if ((corner & 3U) == 3) continue;
        look(corner, corners[LinkedFans::back_of(corner)].neighbour, corners[corner].neighbour);
      }
    };
    for_each_edge([&](CornerId /*corner*/, VertexId from, VertexId /*to*/) { ++begin_[slot(from) + 1]; });
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    std::vector<std::uint32_t> end(begin_.begin(), begin_.end() - 1);
    for_each_edge([&](CornerId corner, VertexId from, VertexId to) { edges_[end[slot(from)]++] = {to, corner}; });
    for (std::size_t v = 0; v + 1 < begin_.size(); ++v) {
      std::sort(edges_.begin() + begin_[v], edges_.begin() + begin_[v + 1]);
    }
  }
  // Null if there is none.
  const CornerId* find(VertexId from, VertexId to) const {
    const auto last = edges_.begin() + begin_[slot(from) + 1];
    const auto found = std::lower_bound(edges_.begin() + begin_[slot(from)], last, Edge{to, 0});
    return found != last && found->first == to ? &found->second : nullptr;
  }

 private:
  using Edge = std::pair<VertexId, CornerId>;
  std::size_t slot(VertexId from) const { return from == kOutside ? begin_.size() - 2 : from; }
  std::vector<std::uint32_t> begin_;  // by vertex, kOutside behind all others
  std::vector<Edge> edges_;
};

}  // namespace

LinkedFans::LinkedFans(std::size_t vertex_count, const std::vector<Triangle>& triangles)
    : base_vertices_(static_cast<std::uint32_t>(vertex_count)) {
  fans_.grow(vertex_count);
  std::vector<Corner> corners;
  const auto add_face = [&](VertexId a, VertexId b, VertexId c) {
    corners.insert(corners.end(), {{b, 0}, {c, 0}, {a, 0}, {}});
  };
  for (const Triangle& t : triangles) add_face(t[0], t[1], t[2]);
  const CornersByEdge inner(vertex_count, corners);
  for (const Triangle& t : triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const VertexId from = t[i];
      const VertexId to = t[(i + 1) % 3];
      if (inner.find(to, from) == nullptr) add_face(to, from, kOutside);
    }
  }
  base_faces_ = static_cast<std::uint32_t>(corners.size() / 4);
  const bool closed = base_faces_ == triangles.size();
  const CornersByEdge all(closed ? 0 : vertex_count, closed ? std::span<const Corner>() : corners);
  const CornersByEdge& corner_of = closed ? inner : all;
  // The corner after (v, b, c) counter-clockwise around v is that of the face on the left of v -> c.
  for (CornerId corner = 0; corner < corners.size(); ++corner) {
    if ((corner & 3U) == 3) continue;
    const VertexId v = corners[back_of(corner)].neighbour;
    const VertexId c = corners[after(corner)].neighbour;
    corners[corner].next = *corner_of.find(v, c);
    if (v == kOutside) continue;
    fans_[v].corner = corner;
    ++fans_[v].count;
  }
  corners_ = PagedArray<Corner>(corners);
}

void LinkedFans::resize(std::size_t vertex_count, PageKind pages) {
  fans_.grow(vertex_count, pages);
  corners_.grow(4 * (base_faces_ + 2 * (vertex_count - base_vertices_)), pages);
}

void LinkedFans::note_use(VertexId first, VertexId last) {
  fans_.note_use(first, last);
  corners_.note_use(first_corner(first), first_corner(last));
}

void LinkedFans::discard(VertexId first, VertexId last) {
  fans_.discard(first, last);
  corners_.discard(first_corner(first), first_corner(last));
}

std::vector<VertexId> LinkedFans::ring(VertexId v) const {
  std::vector<VertexId> ids(fans_[v].count);
  CornerId corner = fans_[v].corner;
  for (VertexId& id : ids) {
    id = corners_[corner].neighbour;
    corner = corners_[corner].next;
  }
  return ids;
}

void LinkedFans::split(VertexId root, VertexId added, std::uint32_t first, std::uint32_t last) {
  const std::uint32_t size = fans_[root].count;
  std::vector<CornerId> corners(size);
  std::vector<CornerId> backs(size);
  CornerId corner = fans_[root].corner;
  for (std::uint32_t i = 0; i < size; ++i, corner = corners_[corner].next) {
    const std::uint32_t from_first = i >= first ? i - first : i + size - first;
    corners[from_first] = corner;
    backs[from_first] = back_of(corner);
  }
  split(root, added, {corners.data(), backs.data(), size, last > first ? last - first : last + size - first});
}

RingMesh::Wings LinkedFans::merge(VertexId root, VertexId added, CornerId root_corner) {
  Corner* c = corners_.data();
  const CornerId a = first_corner(added);
  const CornerId b = a + 4;
  const RingMesh::Wings wings{c[a].neighbour, c[b + 1].neighbour};
  const CornerId first = c[a + 2].next;
  const CornerId last = c[b].next;
  const CornerId before_first = after(c[a + 1].next);  // in the face on the other side of the first wing
  c[after(first)].next = c[a + 1].next;
  c[after(last)].next = c[b + 2].next;
  std::uint32_t taken = 1;
  CornerId corner = first;
  for (;; ++taken) {
    c[back_of(corner)].neighbour = root;
    if (c[corner].next == b + 1) break;
    corner = c[corner].next;
  }
  c[corner].next = last;
  c[before_first].next = first;
  fans_[root] = {root_corner, fans_[root].count + taken - 2};
  fans_[added] = {};
  if (wings.first != kOutside) --fans_[wings.first].count;
  if (wings.last != kOutside) --fans_[wings.last].count;
  for (CornerId i = 0; i < 8; ++i) c[a + i] = {};
  return wings;
}

std::vector<Triangle> LinkedFans::triangles(std::size_t end) const {
  end = std::min(end, fans_.size());
  std::size_t vertices = 0;  // that splits brought
  for (std::size_t v = base_vertices_; v < end; ++v) vertices += fans_[v].count != 0 ? 1 : 0;
  std::vector<Triangle> result(base_faces_ + 2 * vertices + 1);
  Triangle* next = result.data();  // faces to kOutside are written over: cheaper than a branch
  const auto add_face = [&](const Corner* face) {
    const VertexId b = face[0].neighbour;
    const VertexId c = face[1].neighbour;
    const VertexId a = face[2].neighbour;
    *next = {a, b, c};
    next += static_cast<std::ptrdiff_t>(std::max({a, b, c}) != kOutside);
  };
  const Corner* face = corners_.data();
  for (const Corner* const base_end = face + std::size_t{4} * base_faces_; face != base_end; face += 4) add_face(face);
  for (std::size_t v = base_vertices_; v < end; ++v, face += 8) {
    if (fans_[v].count == 0) continue;
    add_face(face);
    add_face(face + 4);
  }
  result.resize(static_cast<std::size_t>(next - result.data()));
  return result;
}

}  // namespace fanstream
