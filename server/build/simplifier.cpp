#include "server/build/simplifier.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>
#include <utility>

#include "common/refine/cell_coder.h"
#include "common/support/cache_lines.h"
#include "server/build/distance_limit.h"
#include "server/build/merge_queue.h"
#include "server/build/merge_valences.h"
#include "server/build/merged_ring.h"
#include "server/build/processors.h"

namespace fanstream {
namespace {

class Simplifier {
 public:
  Simplifier(const TriangleMesh& mesh, const SimplifyOptions& options)
      : options_(options),
        places_(mesh.positions),
        rings_(RingMesh::from_triangles(mesh.positions.size(), mesh.triangles)),
        cost_(make_merge_cost({mesh, rings_, places_}, options.cost, options.evenness)),
        by_valences_(valences_of(options.cost) == Valences::regular),
        marks_(mesh.positions.size()),
        patch_splits_(mesh.positions.size(), 0),
        alive_(static_cast<std::uint32_t>(mesh.positions.size())) {
    if (options.distance_growth > 0.0) limit_.emplace(mesh, options.distance_growth);
    judge_all();
  }

  MergeHistory run() {
    MergeHistory history;
    history.generation_begin.push_back(0);
    const std::uint32_t start = alive_;
    everything_ = false;
    bool limited = false;
    while (alive_ > options_.base_vertices && history.generation_begin.size() <= kMostGenerations) {
      if (limit_) limit_->begin_generation(alive_, limited);
      run_generation(history);
      const auto made = static_cast<std::uint32_t>(history.merges.size()) - history.generation_begin.back();
      if (made != 0) history.generation_begin.push_back(static_cast<std::uint32_t>(history.merges.size()));
      if (made == 0 && everything_) break;
      const bool was_limited = limit_ && limit_->is_limited();
      limited = !was_limited || made > alive_ / 20;
      everything_ =
          (!was_limited && (made == 0 || made < alive_ / 50)) || history.generation_begin.size() > kThriftyGenerations;
      if (options_.progress) options_.progress(progress(start));
    }
    if (!history.free_places.empty()) history.free_places.resize(history.merges.size());
    history.base = std::move(rings_);
    history.base_vertices = alive_;
    return history;
  }

  // MergeQueue's view of the mesh.
  bool is_stale(const MergeCandidate& edge) const {
    return edge.stamp != marks_[edge.a].changes + marks_[edge.b].changes;
  }
  bool is_open(const MergeCandidate& edge) const { return !is_stale(edge) && patches_allow(edge.a, edge.b); }
  bool is_unchanged(VertexId v, std::uint32_t changes) const { return marks_[v].changes == changes; }
  void fetch_state(const MergeCandidate& edge) const {
    fetch_line(&marks_[edge.a]);
    fetch_line(&marks_[edge.b]);
  }
  void fetch_rings(const MergeCandidate& edge) const {
    fetch_line(rings_.ring(edge.a).data());
    fetch_line(rings_.ring(edge.b).data());
  }
  void fetch_places(const MergeCandidate& edge) const {
    for (const VertexId end : {edge.a, edge.b}) {
      for (const VertexId w : rings_.ring(end)) {
        if (w != kOutside) fetch_line(&places_[w]);
      }
    }
  }

 private:
  static constexpr VertexId kNoRoot = kOutside;
  static constexpr std::uint8_t kMostSplitsOfPatch = 64;
  // Where it has not come to an end with that many generations, merging goes on without a limit on cost.
  static constexpr std::size_t kThriftyGenerations = kMostGenerations - 16;
  // Of costs that are computed twice.
  static constexpr double kRounding = 1e-9;
  static constexpr VertexId kSeveralRoots = kOutside - 1;
  // Added to the change count of a vertex that is gone: no sum with another's gives a stamp.
  static constexpr std::uint32_t kGone = 1U << 30U;

  struct Marks {
    std::uint32_t changes = 0;
    VertexId near = kNoRoot;  // the root of a patch of this generation that is the vertex itself or its neighbour
  };

  double progress(std::uint32_t start) const {
    const double done = static_cast<double>(start - alive_);
    return done / std::max(1.0, static_cast<double>(start) - options_.base_vertices);
  }

  MergeCandidate judge(VertexId a, VertexId b) const {
    const MergeProposal proposal = cost_->propose(a, b);
    return {proposal.cost, a, b, marks_[a].changes + marks_[b].changes, proposal.parent, false};
  }

  void judge_all() {
    const std::size_t triangles = 2 * std::size_t{alive_};
    const unsigned threads = cost_->proposes_side_by_side() ? threads_worth_while(triangles) : 1;
    if (threads == 1) {
      judge_vertices(0, places_.size(), [&](const MergeCandidate& edge) { queue_.add(edge); });
      return;
    }
    std::vector<std::vector<MergeCandidate>> runs(4 * std::size_t{threads});
    run_side_by_side(threads, runs.size(), [&](std::size_t run) {
      judge_vertices(places_.size() * run / runs.size(), places_.size() * (run + 1) / runs.size(),
                     [&](const MergeCandidate& edge) { runs[run].push_back(edge); });
    });
    for (std::vector<MergeCandidate>& run : runs) queue_.add(std::exchange(run, {}));
  }

  template <class Sink>
  void judge_vertices(std::size_t begin, std::size_t end, Sink&& sink) const {
    for (auto v = static_cast<VertexId>(begin); v < end; ++v) {
      for (const VertexId w : rings_.ring(v)) {
        if (v < w && w != kOutside) sink(judge(v, w));
      }
    }
  }

  void run_generation(MergeHistory& history) {
    if (!history.merges.empty() && cost_->begin_generation()) {
      queue_ = {};
      judge_all();
    }
    for (Marks& marks : marks_) marks.near = kNoRoot;
    const std::size_t wanted = everything_ ? std::numeric_limits<std::size_t>::max()
                                           : static_cast<std::size_t>(options_.edges_per_vertex * alive_);
    queue_.begin_generation(wanted, *this);
    MergeCandidate best;
    while (alive_ > options_.base_vertices && queue_.take_cheapest(best, *this)) try_merge(best, history);
  }

  bool is_root(VertexId v) const { return marks_[v].near == v; }

  // The conditions of the paper's section 2.3, with patches in the place of fans: no root but one of the two itself is
  // among them and their neighbours. Roots never come to be neighbours, nor do a root's neighbours leave it within a
  // generation.
  bool patches_allow(VertexId a, VertexId b) const {
    const VertexId near = marks_[a].near;
    return near == marks_[b].near && (near == kNoRoot || near == a || near == b);
  }

  void mark_patch(VertexId root) {
    marks_[root].near = root;
    for (const VertexId w : rings_.ring(root)) {
      if (w == kOutside) continue;
      VertexId& near = marks_[w].near;
      near = near == kNoRoot || near == root ? root : kSeveralRoots;
    }
  }

  struct Merge {
    VertexId root;
    VertexId removed;
    ParentPosition parent;
    glm::dvec3 target;
  };

  Merge plan_merge(const MergeCandidate& edge) const {
    Merge merge{edge.a, edge.b, edge.parent, {}};
    if (is_root(edge.b)) {
      std::swap(merge.root, merge.removed);
      merge.parent = cost_->propose(merge.root, merge.removed).parent;
    }
    // Between two centres without a patch, the one at which the parent lies keeps its number.
    if (merge.parent == ParentPosition::added && !is_root(merge.root)) {
      std::swap(merge.root, merge.removed);
      merge.parent = ParentPosition::kept;
    }
    merge.target = places_[merge.root];
    if (merge.parent == ParentPosition::added) merge.target = places_[merge.removed];
    if (merge.parent == ParentPosition::middle) merge.target = 0.5 * (places_[merge.root] + places_[merge.removed]);
    if (merge.parent == ParentPosition::free) merge.target = cost_->propose(merge.root, merge.removed).place;
    return merge;
  }

  // Also assigns ring_.
  bool shape_allows(const Merge& merge) {
    const auto [root, removed, parent, target] = merge;
    if (is_root(root) && patch_splits_[root] == kMostSplitsOfPatch) return false;
    if (rings_.ring_size(root) + rings_.ring_size(removed) - 4 > options_.longest_ring) return false;
    ring_.assign(rings_, root, removed);
    if (!ring_.is_mergeable(rings_)) return false;
    ring_.assign_places(places_);
    const double least = everything_ ? 0.0 : options_.least_normal_cosine;
    return (parent == ParentPosition::kept || ring_.root_may_move(places_[root], target, least)) &&
           (parent == ParentPosition::added || ring_.removed_may_move(places_[removed], target, least));
  }

  // Whether the merge, of that cost by itself, has to wait: behind those that take fewer bits to code, or leave better
  // valences.
  bool put_back(const MergeCandidate& edge, double own_cost, const Merge& merge) {
    MergeCandidate again = edge;
    again.cost = own_cost * coding_penalty(merge);
    if (by_valences_) {
      const MergeValences valences = valences_after(ring_, rings_, merge.root, merge.removed);
      again.cost = cost_with_valences(own_cost, again.cost, queue_.limit(), valences, parity_share(alive_));
    }
    again.weighed = true;
    if (again.cost <= edge.cost * (1.0 + kRounding)) return false;
    queue_.put_back(again);
    return true;
  }

  // Where parity counts, which wings that have changed may have turned.
  bool put_back_again(const MergeCandidate& edge, const Merge& merge) {
    constexpr double kLeastShare = 0.1;
    if (everything_ || !by_valences_ || parity_share(alive_) < kLeastShare) return false;
    return put_back(edge, cost_->propose(edge.a, edge.b).cost, merge);
  }

  void try_merge(const MergeCandidate& best, MergeHistory& history) {
    const Merge merge = plan_merge(best);
    if (best.weighed) {
      // No neighbour of either end has changed since, or its patch would be in the way: only the wings' rings may be
      // shorter.
      ring_.assign(rings_, merge.root, merge.removed);
      if (!ring_.is_mergeable(rings_)) return;
      ring_.assign_places(places_);
      if (put_back_again(best, merge)) return;
    } else {
      if (!shape_allows(merge)) return;
      if (!everything_ && put_back(best, best.cost, merge)) return;
    }
    if (limit_ && !limit_->allows(merge.root, merge.removed, merge.target) && !everything_) return;
    fetch_surroundings(merge);
    record(merge, best.cost, history);
    apply(merge);
  }

  void fetch_surroundings(const Merge& merge) const {
    const VertexId ends[] = {merge.root, merge.removed};
    cost_->fetch(ends);
    cost_->fetch(ring_.ids());
    for (const VertexId w : ring_.ids()) {
      if (w != kOutside) fetch_line(rings_.ring(w).data());
    }
  }

  void record(const Merge& merge, double cost, MergeHistory& history) {
    history.merges.push_back(
        {merge.root, merge.removed, ring_.id(0), ring_.id(ring_.arc()), merge.parent, static_cast<float>(cost)});
    if (merge.parent != ParentPosition::free) return;
    history.free_places.resize(history.merges.size());
    history.free_places.back() = merge.target;
  }

  void apply(const Merge& merge) {
    const auto [root, removed, parent, target] = merge;
    rings_.merge(root, removed);
    if (limit_) limit_->merge(root, removed);
    places_[root] = target;
    cost_->merged(root, removed, parent);
    patch_splits_[root] = static_cast<std::uint8_t>(is_root(root) ? patch_splits_[root] + 1 : 1);
    ++marks_[root].changes;
    marks_[removed].changes += kGone;
    mark_patch(root);
    --alive_;
    std::size_t judged = 0;
    for (const VertexId w : rings_.ring(root)) {
      if (w == kOutside) continue;
      queue_.add(judge(std::min(root, w), std::max(root, w)));
      ++judged;
    }
    queue_.open_around(root, marks_[root].changes, judged, *this);
  }

  // At least 1, more for merges that take many bits.
  double coding_penalty(const Merge& merge) {
    const auto effort = ring_.coding_effort(places_[merge.root], places_[merge.removed], merge.target);
    return 1.0 + options_.coding_weight * (0.3 * std::min(effort.rank, 6) + effort.off_middle);
  }

  const SimplifyOptions& options_;
  std::vector<glm::dvec3> places_;
  RingMesh rings_;
  std::unique_ptr<MergeCost> cost_;
  bool by_valences_;
  std::vector<Marks> marks_;
  std::vector<std::uint8_t> patch_splits_;  // how many vertices a root has absorbed in this generation
  MergeQueue queue_;
  bool everything_ = false;  // the last resort: no limit on cost, faces may turn up to a right angle
  MergedRing ring_;          // of the merge at hand
  std::optional<DistanceLimit> limit_;
  std::uint32_t alive_;
};

}  // namespace

MergeHistory simplify(const TriangleMesh& mesh, const SimplifyOptions& options) {
  return Simplifier(mesh, options).run();
}

}  // namespace fanstream
