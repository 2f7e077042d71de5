#include "client/reduce/collapse_mesh.h"

#include <algorithm>

namespace fanstream {

CollapseMesh::CollapseMesh(const TriangleMesh& mesh)
    : triangles_(mesh.triangles),
      opposite_(3 * mesh.triangles.size(), kNoHalfEdge),
      outgoing_(mesh.positions.size(), kNoHalfEdge),
      faces_around_(mesh.positions.size(), 0),
      marks_(mesh.positions.size(), 0),
      live_(mesh.triangles.size()) {
  pair_half_edges();
  for (HalfEdge h = 0; h < opposite_.size(); ++h) {
    HalfEdge& outgoing = outgoing_[origin(h)];
    if (outgoing == kNoHalfEdge || opposite_[h] == kNoHalfEdge) outgoing = h;
    ++faces_around_[origin(h)];
  }
}

// Half-edges by their lower end, then by the higher one: an edge's two stand side by side.
void CollapseMesh::pair_half_edges() {
  const auto low = [this](HalfEdge h) { return std::min(origin(h), target(h)); };
  std::vector<std::uint32_t> first(outgoing_.size() + 1, 0);
  for (HalfEdge h = 0; h < opposite_.size(); ++h) ++first[low(h) + 1];
  for (std::size_t v = 1; v < first.size(); ++v) first[v] += first[v - 1];
  struct Half {
    VertexId high;
    HalfEdge h;
  };
  std::vector<Half> sorted(opposite_.size());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (HalfEdge h = 0; h < opposite_.size(); ++h) {
    const VertexId lower = low(h);
    sorted[next[lower]++] = {origin(h) == lower ? target(h) : origin(h), h};
  }
  for (std::size_t v = 0; v + 1 < first.size(); ++v) {
    Half* const begin = sorted.data() + first[v];
    Half* const end = sorted.data() + first[v + 1];
    std::sort(begin, end, [](const Half& a, const Half& b) { return a.high != b.high ? a.high < b.high : a.h < b.h; });
    for (Half* at = begin; at + 1 < end; ++at) {
      if (at[0].high != at[1].high) continue;
      opposite_[at[0].h] = at[1].h;
      opposite_[at[1].h] = at[0].h;
    }
  }
}

bool CollapseMesh::can_collapse(HalfEdge h) {
  const VertexId a = origin(h);
  const VertexId b = target(h);
  const HalfEdge o = opposite_[h];
  if (o != kNoHalfEdge && is_boundary(a) && is_boundary(b)) return false;
  if (!may_lose_a_face(apex(h)) || (o != kNoHalfEdge && !may_lose_a_face(apex(o)))) return false;
  begin_marks();
  for_each_edge(a, [&](HalfEdge g) { mark(other_end(g, a)); });
  std::uint32_t shared = 0;
  for_each_edge(b, [&](HalfEdge g) { shared += is_marked(other_end(g, b)) ? 1 : 0; });
  return shared == (o == kNoHalfEdge ? 1U : 2U);
}

std::uint32_t CollapseMesh::faces_after(HalfEdge h) const {
  return faces_around_[origin(h)] + faces_around_[target(h)] - (opposite_[h] == kNoHalfEdge ? 2 : 4);
}

void CollapseMesh::remove_face(HalfEdge h) {
  const HalfEdge x = opposite_[next_of(h)];
  const HalfEdge y = opposite_[previous_of(h)];
  if (x != kNoHalfEdge) opposite_[x] = y;
  if (y != kNoHalfEdge) opposite_[y] = x;
  const VertexId c = apex(h);
  --faces_around_[c];
  // Its leaving half-edge was inside, or the boundary's end here: either way x takes its place.
  if (outgoing_[c] == previous_of(h)) outgoing_[c] = x;
  triangles_[h / 3].fill(kDead);
  --live_;
}

void CollapseMesh::collapse(HalfEdge h, VertexId kept) {
  const VertexId removed = other_end(h, kept);
  const HalfEdge o = opposite_[h];
  const std::uint32_t faces = faces_after(h);
  // A half-edge that leaves the new vertex and stays: beside the face of h, on either side.
  const HalfEdge beside = opposite_[previous_of(h)];
  const HalfEdge across = opposite_[next_of(h)];
  for_each_outgoing(removed, [&](HalfEdge g) { triangles_[g / 3][g % 3] = kept; });
  remove_face(h);
  if (o != kNoHalfEdge) remove_face(o);
  HalfEdge outgoing = beside != kNoHalfEdge ? beside : next_of(across);
  const HalfEdge start = outgoing;
  while (opposite_[outgoing] != kNoHalfEdge) {
    outgoing = next_of(opposite_[outgoing]);
    if (outgoing == start) break;
  }
  outgoing_[kept] = outgoing;
  outgoing_[removed] = kNoHalfEdge;
  faces_around_[kept] = faces;
  faces_around_[removed] = 0;
}

}  // namespace fanstream
