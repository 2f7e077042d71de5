// The work behind reduce_mesh: the cheapest edge becomes a vertex, again and again.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "client/reduce/collapse_mesh.h"
#include "client/reduce/edge_heap.h"
#include "client/reduce/edge_quadric.h"
#include "client/reduce/mesh_reduction.h"
#include "client/reduce/wedge_set.h"

namespace fanstream {

// Not thread safe.
class EdgeReducer {
 public:
  // Preconditions as checked by reduce_mesh. Down to `exact_triangles`, an edge whose surroundings have changed is
  // judged anew only when its turn comes (which takes 0.6 of the time); from there on at once, so that always the
  // cheapest goes.
  EdgeReducer(const TriangleMesh& mesh, const CornerAttributes& attributes, const ReductionOptions& options,
              std::size_t exact_triangles);

  std::size_t triangle_count() const { return mesh_.triangle_count(); }
  // Merges until at most so many triangles are left; false if no edge may be merged any more.
  bool reduce_to(std::size_t triangles);
  // What keeps the edges from being merged. Precondition: reduce_to returned false.
  std::string shortfall() const;
  // The mesh as it is, renumbered without gaps in the order of the source.
  void extract(TriangleMesh& mesh, CornerAttributes& attributes) const;

 private:
  // Why an edge is not in the heap, as its state there.
  static constexpr std::uint32_t kBorder = EdgeHeap::kFirstState;  // would take a vertex off a boundary or a seam
  static constexpr std::uint32_t kTopology = kBorder + 1;
  static constexpr std::uint32_t kFold = kBorder + 2;  // would turn a face over
  static constexpr std::uint32_t kRing = kBorder + 3;  // too many faces around a vertex

  struct Candidate {
    double cost = 0.0;
    double k = 0.0;  // along the half-edge
    VertexId kept = 0;
    bool allowed = false;  // by boundaries and seams
  };
  glm::dvec3 scaled(const glm::dvec3& p) const { return scale_ * (p - center_); }
  bool is_border(HalfEdge h) const {
    return mesh_.opposite(h) == kNoHalfEdge || (!wedges_.empty() && wedges_.is_seam(mesh_, h));
  }
  void add_face_planes(HalfEdge any, double share);
  void judge_all();
  void become_exact();
  Candidate judge(HalfEdge h) const;
  void file(HalfEdge h);  // into the heap, or among those that may not be merged
  bool folds(HalfEdge h, VertexId moved, const glm::dvec3& place) const;
  std::uint32_t obstacle(HalfEdge h, const glm::dvec3& place);  // or kAbsent
  void merge(HalfEdge h, const Candidate& candidate, const glm::dvec3& place);
  void take_star_away(HalfEdge h);
  void judge_around(VertexId vertex);

  ReductionOptions options_;
  std::size_t exact_triangles_;
  bool exact_ = false;
  std::vector<glm::dvec3> positions_;
  std::vector<glm::dvec3> scaled_;  // the same in the unit ball
  glm::dvec3 center_{0.0};
  double scale_ = 1.0;
  CollapseMesh mesh_;
  WedgeSet wedges_;
  std::vector<Quadric> quadrics_;  // in scaled coordinates
  EdgeHeap heap_;
};

}  // namespace fanstream
