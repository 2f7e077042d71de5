// What a fan merge costs and where its parent goes: the interface between the simplifier and the error measures.
// Which measures there are: cost_options.h. How they compare: COSTS.md.
#pragma once

#include <memory>
#include <span>

#include "common/fans/fan_split.h"
#include "common/mesh/triangle_mesh.h"
#include "server/build/cost_options.h"

namespace fanstream {

struct MergeProposal {
  double cost = 0.0;  // finite and never negative; the unit is the measure's own, only order matters
  ParentPosition parent = ParentPosition::kept;
  glm::dvec3 place{0.0};  // of a free parent
};

// The mesh while it is simplified, and what it was. Measures keep it; it stays where it is and changes with every
// merge.
struct MeshView {
  const TriangleMesh& original;
  const RingMesh& rings;
  const std::vector<glm::dvec3>& places;  // by vertex
};

// A measure keeps what it accumulates per vertex itself. Not thread safe, but for what it says of proposals.
class MergeCost {
 public:
  virtual ~MergeCost() = default;
  // The cheapest parent for merging `removed` into its neighbour `root`. The same state gives the same answer.
  virtual MergeProposal propose(VertexId root, VertexId removed) const = 0;
  // Whether several threads may ask for proposals at the same time.
  virtual bool proposes_side_by_side() const { return false; }
  // Announces that proposals for these vertices will be asked for; kOutside among them is ignored.
  virtual void fetch(std::span<const VertexId> /*vertices*/) const {}
  // Called after the merge has been made and the root has its new place; `parent` says where, of the two it was.
  virtual void merged(VertexId root, VertexId removed, ParentPosition parent) = 0;
  // Called before every generation but the first. Returns whether proposals may have changed for edges whose ends have
  // not: because of merges beside them.
  virtual bool begin_generation() { return false; }
};

// Precondition: check_cost_options(options), and `view` is of the mesh before the first merge.
// `evenness` is for the quadrics: the cost is the sum of squared distances over area, times its mean to the power of
// `evenness`: 0 makes the sum over the whole mesh small, more of it makes small the distances that are largest.
std::unique_ptr<MergeCost> make_merge_cost(const MeshView& view, const CostOptions& options, double evenness);

// Which make_merge_cost chooses from.
std::unique_ptr<MergeCost> make_fans_cost(const MeshView& view, const CostOptions& options);
std::unique_ptr<MergeCost> make_quadric_cost(const MeshView& view, const CostOptions& options, double evenness);

}  // namespace fanstream
