// Progressive fans as Suzuki, Okamoto and Kanai make them: the mesh is converted to fans once, and these are merged
// until none can be merged any more.
#pragma once

#include <memory>
#include <queue>
#include <vector>

#include "common/fans/fan_mesh.h"
#include "common/support/result.h"
#include "server/build/merge_cost.h"

namespace fanstream::bench {

// The conversion is that of section 3.2 (CoverMethod::paper). A merge joins two fans into one around a centre where
// the cost proposes it. Its conditions are those of section 2.3: (1) the centres are neighbours;
// (2) all faces around either belong to one of the two fans. A merge that turns a face over is refused (section 3.3),
// as is one that leaves no manifold. Of all pairs that may be merged the cheapest goes first.
//
// Fans persist: level k, of k splits, has k fans and k vertices more than level 0, and each split touches one fan only.
class SingleGeneration {
 public:
  // Merges all that can be merged: stands at level 0. `mesh` must be an oriented manifold. Fails as cover_with_fans and
  // check_cost_options do.
  static Result<std::unique_ptr<SingleGeneration>> build(const TriangleMesh& mesh, const CostOptions& cost);

  std::size_t level_count() const { return merges_.size() + 1; }
  std::size_t level() const { return level_; }
  // Splits or merges along the history. Precondition: level < level_count().
  void go_to(std::size_t level);

  // The original's numbers of the vertices that there are, ascending; mesh() and fans() number them in this order.
  std::vector<VertexId> vertices() const;
  TriangleMesh mesh() const;
  FanMesh fans() const;  // their vertices have no normals

  // Whether the two conditions hold for the fans of these centres (by the original's numbers) as they are. Exposed for
  // tests.
  bool conditions_hold(VertexId a, VertexId b) const;
  // What a step from level k to k + 1 splits. Precondition: k + 1 < level_count().
  struct Split {
    VertexId root = 0, added = 0;  // by the original mesh's numbers
  };
  Split split_after(std::size_t level) const;

 private:
  struct LooseFan {
    VertexId center = 0;
    std::vector<VertexId> ring;
    bool closed = false;
    std::uint32_t face_count() const { return static_cast<std::uint32_t>(closed ? ring.size() : ring.size() - 1); }
  };
  struct Pair {
    double cost = 0.0;
    VertexId root = 0, removed = 0;
    ParentPosition parent = ParentPosition::kept;
    glm::dvec3 target{0.0};   // where the parent goes
    std::uint32_t stamp = 0;  // whether an end has changed since it was judged
  };
  struct IsDearer {
    bool operator()(const Pair& x, const Pair& y) const;
  };
  struct MergeOfFans {
    VertexId root = 0, removed = 0;
    RingMesh::Wings wings;
    glm::dvec3 root_place{0.0}, removed_place{0.0}, parent_place{0.0};
    LooseFan of_root, of_removed, of_parent;
  };

  explicit SingleGeneration(const TriangleMesh& mesh);
  void take_fans(const FanMesh& fans);
  void merge_all(MergeCost& cost);
  void consider(VertexId a, VertexId b, const MergeCost& cost);
  bool keeps_faces_upright(const Pair& pair) const;
  glm::dvec3 target_of(VertexId root, VertexId removed, const MergeProposal& proposal) const;
  void merge(const Pair& pair);
  void consider_around(VertexId root, const MergeCost& cost);
  LooseFan whole_fan(VertexId center) const;
  std::uint32_t faces_around(VertexId v) const;
  void split_once();
  void merge_once();
  std::vector<VertexId> numbers() const;

  TriangleMesh original_;
  RingMesh rings_;
  std::vector<glm::dvec3> places_;
  std::vector<LooseFan> fan_of_;          // by centre, where it has one fan
  std::vector<std::uint32_t> fan_count_;  // by centre
  std::vector<LooseFan> others_;          // those of centres with several: condition 2 never holds for these
  std::vector<MergeOfFans> merges_;       // in the order in which they were made
  std::priority_queue<Pair, std::vector<Pair>, IsDearer> pairs_;
  std::vector<std::uint32_t> changes_;
  std::size_t level_ = 0;
};

}  // namespace fanstream::bench
