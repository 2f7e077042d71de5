// What a fan merge costs and where its parent goes: the interface between the simplifier and the error measures.
#pragma once

#include <memory>
#include <span>

#include "common/fans/fan_split.h"
#include "common/mesh/triangle_mesh.h"

namespace fanstream {

struct MergeProposal {
  double cost = 0.0;  // never negative; the unit is the measure's own, only order matters
  ParentPosition parent = ParentPosition::kept;
};

// A measure keeps what it accumulates per vertex itself. Not thread safe.
class MergeCost {
 public:
  virtual ~MergeCost() = default;
  // The cheapest parent for merging `removed` into `root` at their current places.
  virtual MergeProposal propose(VertexId root, VertexId removed, const glm::dvec3& root_place,
                                const glm::dvec3& removed_place) const = 0;
  // Announces that proposals for these vertices will be asked for; kOutside among them is ignored.
  virtual void fetch(std::span<const VertexId> vertices) const = 0;
  // Called after the merge has been made.
  virtual void merged(VertexId root, VertexId removed) = 0;
};

// Quadric error metrics (Garland and Heckbert 1997): area-weighted planes of all faces that each vertex stands for, and
// planes upright on boundary edges, so that borders keep their course. `rings` is the mesh's own. The cost is that sum of
// squared distances over area, times its mean to the power of `evenness`: 0 makes the sum over the whole mesh small, more
// of it makes small the distances that are largest.
std::unique_ptr<MergeCost> make_quadric_cost(const TriangleMesh& mesh, const RingMesh& rings, double evenness = 0.0);

}  // namespace fanstream
