// The connectivity of a manifold whose edges are merged, one after another.
#pragma once

#include <cstdint>
#include <vector>

#include "common/mesh/triangle_mesh.h"

namespace fanstream {

using HalfEdge = std::uint32_t;  // 3 * triangle + i: from its corner i to the next
inline constexpr HalfEdge kNoHalfEdge = 0xFFFFFFFFU;

inline HalfEdge next_of(HalfEdge h) { return h % 3 == 2 ? h - 2 : h + 1; }
inline HalfEdge previous_of(HalfEdge h) { return h % 3 == 0 ? h + 2 : h - 1; }

// Not thread safe.
class CollapseMesh {
 public:
  // Precondition: an oriented manifold (is_oriented_manifold) of less than 2^32 / 3 triangles.
  explicit CollapseMesh(const TriangleMesh& mesh);

  std::size_t triangle_count() const { return live_; }
  std::size_t half_edge_count() const { return opposite_.size(); }
  bool is_live(HalfEdge h) const { return triangles_[h / 3][0] != kDead; }
  VertexId origin(HalfEdge h) const { return triangles_[h / 3][h % 3]; }
  VertexId target(HalfEdge h) const { return origin(next_of(h)); }
  VertexId apex(HalfEdge h) const { return origin(previous_of(h)); }  // the third corner
  HalfEdge opposite(HalfEdge h) const { return opposite_[h]; }        // kNoHalfEdge on a boundary
  // One number for both half-edges of an edge.
  HalfEdge edge_of(HalfEdge h) const { return opposite_[h] < h ? opposite_[h] : h; }
  bool is_boundary(VertexId v) const { return opposite_[outgoing_[v]] == kNoHalfEdge; }
  std::uint32_t faces_around(VertexId v) const { return faces_around_[v]; }

  // Calls visit(h) for every half-edge that leaves v, one a face; on a boundary the first is the boundary's.
  template <class Visit>
  void for_each_outgoing(VertexId v, Visit visit) const {
    const HalfEdge first = outgoing_[v];
    HalfEdge h = first;
    do {
      const HalfEdge following = opposite_[previous_of(h)];
      visit(h);
      h = following;
    } while (h != kNoHalfEdge && h != first);
  }
  // Calls visit(h) for one half-edge of every edge at v.
  template <class Visit>
  void for_each_edge(VertexId v, Visit visit) const {
    for_each_outgoing(v, [&](HalfEdge h) {
      visit(h);
      if (opposite_[previous_of(h)] == kNoHalfEdge) visit(previous_of(h));
    });
  }
  VertexId other_end(HalfEdge h, VertexId v) const { return origin(h) == v ? target(h) : origin(h); }

  // The link condition: whether the mesh stays a manifold with the same topology when the edge becomes a vertex.
  bool can_collapse(HalfEdge h);
  // Faces around the vertex that replaces the edge.
  std::uint32_t faces_after(HalfEdge h) const;

  // Makes one vertex of the edge: `kept`, one of its ends. Removes one or two triangles. Precondition: can_collapse(h).
  void collapse(HalfEdge h, VertexId kept);

  // Marks for walks: a new mark forgets all others.
  void begin_marks() { ++mark_; }
  void mark(VertexId v) { marks_[v] = mark_; }
  bool is_marked(VertexId v) const { return marks_[v] == mark_; }

 private:
  static constexpr VertexId kDead = 0xFFFFFFFFU;
  void pair_half_edges();
  void remove_face(HalfEdge h);
  bool may_lose_a_face(VertexId v) const { return faces_around_[v] > (is_boundary(v) ? 1U : 3U); }

  std::vector<Triangle> triangles_;
  std::vector<HalfEdge> opposite_;
  std::vector<HalfEdge> outgoing_;  // of each vertex one; on a boundary the boundary's
  std::vector<std::uint32_t> faces_around_;
  std::vector<std::uint32_t> marks_;
  std::uint32_t mark_ = 0;
  std::size_t live_ = 0;
};

}  // namespace fanstream
