// A mesh kept as the closed (on a boundary: open) fan of every vertex: the state that FanSplits refine and coarsen in
// place.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/mesh/triangle_mesh.h"
#include "common/support/result.h"

namespace fanstream {

// Stands in a ring for the outside of the mesh. A boundary vertex has it once, between its last and its first
// neighbour, so that an open fan is a closed fan around which some faces are not drawn, and boundary cases need no code
// of their own.
inline constexpr VertexId kOutside = 0xFFFFFFFFU;

// The rings of all vertices, counter-clockwise seen from outside, each cyclic and starting anywhere. Vertices are known
// by number only; positions are kept elsewhere. split() and merge() are exact inverses and cost time proportional to
// the valences touched. Thread safety: like a standard container.
class RingMesh {
 public:
  // Precondition: `triangles` are an oriented manifold (is_oriented_manifold) over vertices 0..vertex_count-1.
  static RingMesh from_triangles(std::size_t vertex_count, const std::vector<Triangle>& triangles);

  std::size_t vertex_capacity() const { return slots_.size(); }  // one past the largest vertex number
  bool contains(VertexId v) const { return v < slots_.size() && slots_[v].count != 0; }

  // The ring of v, valid until the next change of the mesh. Empty for a vertex that is not in the mesh.
  std::span<const VertexId> ring(VertexId v) const { return {pool_.data() + slots_[v].offset, slots_[v].count}; }
  std::uint32_t ring_size(VertexId v) const { return slots_[v].count; }
  bool is_boundary(VertexId v) const;

  // FanSplit of the closed fan of `root`: the new vertex takes over the ring from its position `first`
  // counter-clockwise to position `last`, both wings included; `root` keeps the rest, both wings included. Either wing
  // may be kOutside: then one face is inserted instead of two. Preconditions: root is in the mesh, first != last, both
  // < ring_size(root), and added is not in the mesh.
  void split(VertexId root, VertexId added, std::uint32_t first, std::uint32_t last);

  // FanMerge, the inverse: `removed` is absorbed by its neighbour `root`. Precondition: can_merge(root, removed).
  void merge(VertexId root, VertexId removed);

  // The link condition on the mesh closed up by kOutside: the two ends have exactly their two wings in common, and
  // neither the rest nor a tetrahedron degenerates. True also implies that removed is a neighbour of root.
  bool can_merge(VertexId root, VertexId removed) const;

  // The two wings of edge {root, removed}: the first and the last ring vertex that `removed` would take over in a
  // split.
  struct Wings {
    VertexId first = kOutside;
    VertexId last = kOutside;
  };
  Wings wings(VertexId root, VertexId removed) const;

  // Position of `neighbour` in the ring of v, or ring_size(v) if it is not there.
  std::uint32_t position_in_ring(VertexId v, VertexId neighbour) const;

  // Every face once, in order of its smallest vertex, which stands first.
  std::vector<Triangle> triangles() const;
  std::size_t memory_bytes() const;
  void reserve(std::size_t vertex_count);

 private:
  struct Slot {
    std::uint32_t offset = 0;
    std::uint32_t count = 0;
  };
  // Rings take room by fours, eight at least: most never outgrow that.
  static std::uint32_t size_class(std::uint32_t count) { return count <= 8 ? 2 : (count + 3) / 4; }
  std::uint32_t allocate(std::uint32_t count);
  void release(std::uint32_t offset, std::uint32_t count);
  void resize_ring(VertexId v, std::uint32_t count);
  void insert_in_ring(VertexId v, std::uint32_t position, VertexId added);
  void remove_from_ring(VertexId v, VertexId removed);
  void replace_in_ring(VertexId v, VertexId from, VertexId to);

  std::vector<Slot> slots_;
  std::vector<VertexId> pool_;
  std::vector<std::vector<std::uint32_t>> free_;  // free pool offsets by size class
};

}  // namespace fanstream
