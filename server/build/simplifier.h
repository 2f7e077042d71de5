// Greedy fan merges in generations: from a manifold mesh to its coarsest level, with the history that FanSplits undo.
#pragma once

#include <functional>
#include <vector>

#include "common/fans/fan_split.h"
#include "common/mesh/triangle_mesh.h"
#include "server/build/merge_cost.h"

namespace fanstream {

struct SimplifyOptions {
  // Stop at this many vertices. Fewer than 4 per component cannot be reached.
  std::uint32_t base_vertices = 256;
  // A generation considers the cheapest edges, this many per vertex. More makes fewer and larger generations (smaller
  // files, less forced refinement) at the price of shape: cheap merges at patch borders wait while dearer ones go
  // first.
  double edges_per_vertex = 1.5;
  // What a merge costs and where its parent goes. Precondition: check_cost_options.
  CostOptions cost;
  // 0 makes the surface's mean distance from the original small, 1 or 2 its largest; see make_merge_cost.
  double evenness = 0.0;
  // Merges that would leave a place of the original much further off than others of their generation do wait for a
  // later one (distance_limit.h): further than this times what 90 % of the merges of the generation before have left.
  // 0: none does.
  double distance_growth = 0.0;
  // How much merges that take many bits to code are put back behind others of like cost; 0 looks at shape alone.
  double coding_weight = 1.0;
  // A merge that would turn a face by more than this angle's cosine is refused.
  double least_normal_cosine = 0.2;
  // A merge that would give the parent a longer ring is refused.
  std::uint32_t longest_ring = 24;
  std::function<void(double fraction)> progress;  // called between generations; may be empty
};

// One fan merge. `first` and `last` are the wings in the sense of FanSplit, by number.
struct MergeRecord {
  VertexId root = 0;
  VertexId removed = 0;
  VertexId first = kOutside;
  VertexId last = kOutside;
  ParentPosition parent = ParentPosition::kept;
  float cost = 0.0F;
};

// Merges in the order they were made: finest generation first.
struct MergeHistory {
  std::vector<MergeRecord> merges;
  std::vector<std::uint32_t> generation_begin;  // into merges; one more entry than generations
  std::vector<glm::dvec3> free_places;          // by merge: where a free parent lies; empty if there are none
  RingMesh base;                                // what remains
  std::uint32_t base_vertices = 0;

  std::uint32_t generation_count() const { return static_cast<std::uint32_t>(generation_begin.size()) - 1; }
};

// Within a generation every merge obeys the paper's two conditions on patches: all faces around both centres are free
// or belong to the root's own patch, so that patches share no face and can be split in any order. Judged in the model's
// own coordinates. Precondition: `mesh` is an oriented manifold. Deterministic.
MergeHistory simplify(const TriangleMesh& mesh, const SimplifyOptions& options);

}  // namespace fanstream
