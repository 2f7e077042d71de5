// A mesh as the linked closed (on a boundary: open) fans of all vertices: the state that FanSplits refine and coarsen
// in place.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <span>
#include <vector>

#include "common/fans/ring_mesh.h"
#include "common/support/cache_lines.h"
#include "common/support/paged_array.h"

namespace fanstream {

// Every face has a corner at each of its vertices. The corners at a vertex are linked counter-clockwise into its fan;
// with each stands the first of the face's other two vertices, so that the fan's corners spell the vertex's ring. A
// boundary is closed up by faces to kOutside, which are not drawn, so that an open fan is linked all around like a
// closed one.
//
// split() and merge() are exact inverses; they cost time proportional to the new vertex's valence, whatever the others'
// are. The two faces that a split inserts have places of their own, given by the new vertex's number. Thread safety:
// like a standard container.
class LinkedFans {
 public:
  // A corner of face `corner / 4` at its vertex `corner % 4`.
  using CornerId = std::uint32_t;
  struct Corner {
    VertexId neighbour = 0;  // the next vertex of the face, counter-clockwise
    CornerId next = 0;       // the corner at the same vertex in the next face, counter-clockwise
  };

  LinkedFans() = default;
  // Precondition: `triangles` are an oriented manifold (is_oriented_manifold) over vertices 0..vertex_count-1.
  LinkedFans(std::size_t vertex_count, const std::vector<Triangle>& triangles);
  // Makes room for vertices up to vertex_count - 1, which only split() brings into the mesh. Room that is not in use
  // takes no memory.
  void resize(std::size_t vertex_count, PageKind pages = PageKind::huge);
  // PagedArray's, for vertices [first, last) that split() brings; of those that are given back none is in the mesh.
  void note_use(VertexId first, VertexId last);
  void discard(VertexId first, VertexId last);

  std::size_t vertex_capacity() const { return fans_.size(); }  // one past the largest vertex number
  bool contains(VertexId v) const { return v < fans_.size() && fans_[v].count != 0; }
  // The faces of a fan, those to kOutside included, which is also the size of the ring, with kOutside once on a
  // boundary.
  std::uint32_t ring_size(VertexId v) const { return fans_[v].count; }
  // Where the fan starts: of a root at the first of the faces that its latest split inserted, of a new vertex at its
  // corner of that face, before the first split at the vertex's last corner in the order of faces. It does not depend
  // on what is split around it.
  CornerId corner(VertexId v) const { return fans_[v].corner; }
  const Corner* corners() const { return corners_.data(); }
  // Asks for the memory of a vertex's fan and of the faces that it came with.
  void fetch(VertexId v) const {
    fetch_line(fans_.data() + v);
    if (v >= base_vertices_) fetch_line(corners_.data() + first_corner(v));
  }
  // The ring, counter-clockwise seen from outside, from corner(v) on. Empty for a vertex that is not in the mesh.
  std::vector<VertexId> ring(VertexId v) const;
  template <class Visitor>
  void for_each_neighbour(VertexId v, Visitor&& visit) const {
    CornerId corner = fans_[v].corner;
    for (std::uint32_t left = fans_[v].count; left > 0; --left) {
      const Corner c = corners_[corner];
      if (c.neighbour != kOutside) visit(c.neighbour);
      corner = c.next;
    }
  }

  // FanSplit of the fan of `root`: `added`, which is not in the mesh, takes over the ring from the first wing
  // counter-clockwise to the last, both included; `root` keeps the rest, both wings included. Either wing may be
  // kOutside: then one face is inserted instead of two.
  struct Arc {
    const CornerId* corners;  // of the root's fan, in order from the one that spells the first wing, once around
    const CornerId* backs;    // back_of each of them
    std::uint32_t size;       // of the fan
    std::uint32_t length;     // which of them spells the last wing
  };
  void split(VertexId root, VertexId added, const Arc& arc);
  // The corner of the same face that spells this one's vertex.
  static CornerId back_of(CornerId corner) { return (corner & 3U) == 0 ? corner + 2 : corner - 1; }
  // The same by positions in ring(root).
  void split(VertexId root, VertexId added, std::uint32_t first, std::uint32_t last);

  // The inverse; the fan of `root` starts at `root_corner` again. Precondition: the split of `root` that brought
  // `added` is the latest of its surroundings. Returns the wings.
  RingMesh::Wings merge(VertexId root, VertexId added, CornerId root_corner);

  // Two words' worth to remember with a vertex that split() brought, in room that its faces leave; merge() forgets it.
  using Note = std::array<Corner, 2>;
  void set_note(VertexId added, const Note& note) {
    Corner* const faces = corners_.data() + first_corner(added);
    faces[3] = note[0];
    faces[7] = note[1];
  }
  Note note(VertexId added) const {
    const Corner* const faces = corners_.data() + first_corner(added);
    return {faces[3], faces[7]};
  }

  // Every face once: those of the base, then by the numbers of the vertices that they came with. `end` is beyond all
  // vertices of the mesh.
  std::vector<Triangle> triangles(std::size_t end) const;
  std::vector<Triangle> triangles() const { return triangles(fans_.size()); }
  std::size_t memory_bytes() const { return corners_.resident_bytes() + fans_.resident_bytes(); }

 private:
  struct Fan {
    CornerId corner = 0;
    std::uint32_t count = 0;
  };
  // The next corner of the same face.
  static CornerId after(CornerId corner) { return (corner & 3U) == 2 ? corner - 2 : corner + 1; }
  // The first corner of the first of the two faces that came with `added`.
  CornerId first_corner(VertexId added) const { return 4 * (base_faces_ + 2 * (added - base_vertices_)); }

  PagedArray<Corner> corners_;    // by fours, the fourth for notes
  PagedArray<Fan> fans_;          // by vertex
  std::uint32_t base_faces_ = 0;  // with those to kOutside
  std::uint32_t base_vertices_ = 0;
};

// The new faces are A = (root, first wing, added) and B = (root, added, last wing).
inline void LinkedFans::split(VertexId root, VertexId added, const Arc& arc) {
  assert(added < fans_.size() && fans_[added].count == 0 && arc.length > 0 && arc.length < arc.size);
  const CornerId first = arc.corners[0];
  const CornerId last = arc.corners[arc.length];
  Corner* c = corners_.data();
  const VertexId wing_first = c[first].neighbour;
  const VertexId wing_last = c[last].neighbour;
  const CornerId a = first_corner(added);
  const CornerId b = a + 4;
  // The arc's faces change hands. Of a short arc the last one is told so more than once: a loop as long as the arc
  // would end in a coin toss.
  constexpr std::uint32_t kShort = 4;
  for (std::uint32_t i = 0; i < kShort; ++i) c[arc.backs[std::min(i, arc.length - 1)]].neighbour = added;
  for (std::uint32_t i = kShort; i < arc.length; ++i) c[arc.backs[i]].neighbour = added;
  const CornerId beside_first = after(first);  // the wing's corner in the arc's first face: A follows it
  const CornerId beside_last = after(last);    // the wing's corner in the face after the arc: B follows it
  c[a] = {wing_first, b};
  c[a + 1] = {added, c[beside_first].next};
  c[a + 2] = {root, first};
  c[b] = {added, last};
  c[b + 1] = {wing_last, a + 2};
  c[b + 2] = {root, c[beside_last].next};
  c[beside_first].next = a + 1;
  c[beside_last].next = b + 2;
  c[arc.corners[arc.size - 1]].next = a;
  c[arc.corners[arc.length - 1]].next = b + 1;
  fans_[added] = {a + 2, arc.length + 2};
  fans_[root] = {a, arc.size - arc.length + 2};
  if (wing_first != kOutside) ++fans_[wing_first].count;
  if (wing_last != kOutside) ++fans_[wing_last].count;
}

}  // namespace fanstream
