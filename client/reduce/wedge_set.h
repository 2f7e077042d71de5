// Attributes of a mesh whose edges are merged: which corners share which, and how they follow.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "client/reduce/collapse_mesh.h"
#include "common/mesh/vertex_attributes.h"

namespace fanstream {

// What an edge may become with respect to seams.
struct EdgeEnds {
  bool first_removable = false;  // the origin: its attributes can follow the target's
  bool second_removable = false;
};

// Corners of one vertex with equal attributes share a wedge. An edge is a seam where the wedges of its two sides differ
// at either end. Without attributes every vertex is one wedge and nothing is stored. Not thread safe.
class WedgeSet {
 public:
  // Preconditions: `mesh` was made from `triangles`; attributes are consistent (check_attributes).
  WedgeSet(const std::vector<Triangle>& triangles, std::size_t vertex_count, const CornerAttributes& attributes);

  bool empty() const { return wedge_of_.empty(); }
  bool is_seam(const CollapseMesh& mesh, HalfEdge h) const;

  // An end is removable where all its wedges touch the edge and those of either side can become the other end's. If
  // both ends are, the new vertex may lie anywhere on the edge; if one is, at the other end.
  EdgeEnds ends(const CollapseMesh& mesh, HalfEdge h) const;

  // What the edge's collapse does to the attributes; to be called before CollapseMesh::collapse with the same
  // arguments, and settle() after it. `k` along h, in [0, 1].
  void collapse(const CollapseMesh& mesh, HalfEdge h, VertexId kept, double k);
  // Counts anew where a triangle has gone: the kept vertex and the edge's apexes.
  void settle(const CollapseMesh& mesh, VertexId vertex);

  // The wedges of a triangle's corners.
  Triangle wedges(std::uint32_t triangle) const {
    return {wedge_of_[3 * triangle], wedge_of_[3 * triangle + 1], wedge_of_[3 * triangle + 2]};
  }
  const VertexAttributes& values() const { return values_; }

 private:
  std::uint32_t wedge_for(VertexId vertex, std::uint32_t source, const VertexAttributes& from);
  bool equal(std::uint32_t wedge, std::uint32_t source, const VertexAttributes& from) const;
  // Of each side of the edge: the wedges at its origin and its target.
  struct Sides {
    std::array<std::array<std::uint32_t, 2>, 2> wedges{};
    std::size_t count = 0;
  };
  Sides sides(const CollapseMesh& mesh, HalfEdge h) const;
  bool removable(VertexId v, const Sides& sides, std::size_t end) const;

  std::vector<std::uint32_t> wedge_of_;      // of corners, numbered as half-edges
  std::vector<std::uint32_t> wedge_count_;   // of vertices
  std::vector<std::uint32_t> first_, next_;  // while they are gathered: the wedges of each vertex
  VertexAttributes values_;
};

}  // namespace fanstream
