// The ring around two neighbouring centres, which is the ring of their parent once they are merged.
#pragma once

#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "common/fans/ring_mesh.h"

namespace fanstream {

// Counter-clockwise from the first wing: positions 0 to arc() belong to the centre to be removed, from arc() on and
// back to 0 to the root; both wings to both. Reused from merge to merge to avoid allocation; not thread safe.
class MergedRing {
 public:
  // Precondition: root and removed are neighbours.
  void assign(const RingMesh& rings, VertexId root, VertexId removed);
  // RingMesh::can_merge(root, removed), from what assign() has gathered.
  bool is_mergeable(const RingMesh& rings) const;
  void assign_places(std::span<const glm::dvec3> places);

  std::size_t size() const { return ids_.size(); }
  std::size_t arc() const { return arc_; }
  std::size_t gap() const { return gap_; }  // the position of kOutside, or size()
  bool is_open() const { return gap_ < ids_.size(); }
  VertexId id(std::size_t i) const { return ids_[i]; }
  std::span<const VertexId> ids() const { return ids_; }
  std::span<const glm::dvec3> places() const { return places_; }  // of the gap: nothing

  // Whether no face of one of the centres turns by more than the angle of that cosine, or folds, when the centre moves.
  bool root_may_move(const glm::dvec3& from, const glm::dvec3& to, double least_cosine) const {
    return faces_keep(arc_, size(), from, to, least_cosine);
  }
  bool removed_may_move(const glm::dvec3& from, const glm::dvec3& to, double least_cosine) const {
    return faces_keep(0, arc_, from, to, least_cosine);
  }

  // What makes a merge take many bits. The rank of the removed centre's arc among the arcs of its length, by how far
  // they reach from `target` (RingGeometry::first_of_rank), 0 in an open ring; and how far the removed centre lies off
  // the middle of its own ring, squared, in mean squared spokes of the merged ring.
  struct CodingEffort {
    int rank = 0;
    double off_middle = 0.0;
  };
  CodingEffort coding_effort(const glm::dvec3& root_place, const glm::dvec3& removed_place, const glm::dvec3& target);

 private:
  bool faces_keep(std::size_t first, std::size_t end, const glm::dvec3& from, const glm::dvec3& to,
                  double least_cosine) const;

  std::vector<VertexId> ids_;
  std::vector<glm::dvec3> places_;
  std::vector<double> squares_;  // of the spokes' lengths, twice around
  std::size_t arc_ = 0;
  std::size_t gap_ = 0;
};

}  // namespace fanstream
