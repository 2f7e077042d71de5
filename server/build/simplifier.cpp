#include "server/build/simplifier.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "common/refine/cell_coder.h"
#include "server/build/merge_deviation.h"

namespace fanstream {
namespace {

struct Candidate {
  double cost;
  VertexId a;
  VertexId b;
  std::uint32_t stamp;     // sum of both ends' change counts when it was judged
  bool penalised = false;  // the cost includes what its coding takes
};

// Orders a heap with the cheapest on top; ties by number, so that every machine makes the same model.
struct Dearer {
  bool operator()(const Candidate& x, const Candidate& y) const {
    if (x.cost != y.cost) return x.cost > y.cost;
    return x.a != y.a ? x.a > y.a : x.b > y.b;
  }
};

class Simplifier {
 public:
  Simplifier(const TriangleMesh& mesh, const SimplifyOptions& options)
      : options_(options),
        places_(mesh.positions),
        rings_(RingMesh::from_triangles(mesh.positions.size(), mesh.triangles)),
        cost_(make_quadric_cost(mesh, rings_)),
        patch_root_(mesh.positions.size(), 0),
        patch_splits_(mesh.positions.size(), 0),
        changes_(mesh.positions.size(), 0),
        deviations_(mesh.positions.size(), 0.0F),
        halvings_(mesh.positions.size(), 0),
        alive_(static_cast<std::uint32_t>(mesh.positions.size())) {
    live_.resize(alive_);
    for (VertexId v = 0; v < alive_; ++v) live_[v] = v;
  }

  MergeHistory run() {
    MergeHistory history;
    history.generation_begin.push_back(0);
    const std::uint32_t start = alive_;
    bool everything = false;  // the last resort: no limit on cost, faces may turn up to a right angle
    while (alive_ > options_.base_vertices) {
      ++generation_;
      run_generation(history, everything);
      const auto made = static_cast<std::uint32_t>(history.merges.size()) - history.generation_begin.back();
      if (made != 0) history.generation_begin.push_back(static_cast<std::uint32_t>(history.merges.size()));
      if (made == 0 && everything) break;
      everything = made == 0 || made < alive_ / 50;
      if (options_.progress) options_.progress(progress(start));
    }
    history.base = std::move(rings_);
    history.base_vertices = alive_;
    return history;
  }

 private:
  double progress(std::uint32_t start) const {
    const double done = static_cast<double>(start - alive_);
    return done / std::max(1.0, static_cast<double>(start) - options_.base_vertices);
  }

  Candidate judge(VertexId a, VertexId b) const {
    return {cost_->propose(a, b, places_[a], places_[b]).cost, a, b, changes_[a] + changes_[b], false};
  }

  // The generation's candidates, cheapest first, in sorted_; returns the limit of their costs.
  double gather(bool everything) {
    sorted_.clear();
    heap_.clear();
    next_sorted_ = 0;
    for (const VertexId v : live_) {
      for (const VertexId w : rings_.ring(v)) {
        if (v < w && w != kOutside) sorted_.push_back(judge(v, w));
      }
    }
    const auto cheaper = [](const Candidate& x, const Candidate& y) { return Dearer{}(y, x); };
    const auto wanted = static_cast<std::size_t>(options_.edges_per_vertex * alive_);
    double limit = std::numeric_limits<double>::infinity();
    if (!everything && wanted < sorted_.size()) {
      std::nth_element(sorted_.begin(), sorted_.begin() + static_cast<std::ptrdiff_t>(wanted), sorted_.end(), cheaper);
      limit = sorted_[wanted].cost;
      sorted_.resize(wanted);
    }
    std::sort(sorted_.begin(), sorted_.end(), cheaper);
    return limit;
  }

  // The cheapest candidate left, of those gathered and those judged since.
  bool take_cheapest(Candidate& best) {
    const bool sorted_left = next_sorted_ < sorted_.size();
    if (heap_.empty() && !sorted_left) return false;
    if (heap_.empty() || (sorted_left && Dearer{}(heap_.front(), sorted_[next_sorted_]))) {
      best = sorted_[next_sorted_++];
      return true;
    }
    std::pop_heap(heap_.begin(), heap_.end(), Dearer{});
    best = heap_.back();
    heap_.pop_back();
    return true;
  }

  void run_generation(MergeHistory& history, bool everything) {
    const double limit = gather(everything);
    Candidate best{};
    while (alive_ > options_.base_vertices && take_cheapest(best)) {
      if (!rings_.contains(best.a) || !rings_.contains(best.b)) continue;
      if (best.stamp != changes_[best.a] + changes_[best.b]) continue;
      try_merge(best, limit, everything, history);
    }
    live_.erase(std::remove_if(live_.begin(), live_.end(), [this](VertexId v) { return !rings_.contains(v); }),
                live_.end());
  }

  // The conditions of the paper's section 2.3, with patches in the place of fans.
  bool patches_allow(VertexId a, VertexId b) const {
    const bool a_is_root = patch_root_[a] == generation_;
    const bool b_is_root = patch_root_[b] == generation_;
    if (a_is_root && b_is_root) return false;
    const auto foreign_root = [&](VertexId w) {
      return w != kOutside && w != a && w != b && patch_root_[w] == generation_;
    };
    const auto ring_a = rings_.ring(a);
    const auto ring_b = rings_.ring(b);
    return std::none_of(ring_a.begin(), ring_a.end(), foreign_root) &&
           std::none_of(ring_b.begin(), ring_b.end(), foreign_root);
  }

  bool keeps_faces(VertexId centre, VertexId other, const glm::dvec3& target, bool everything) const {
    const auto ring = rings_.ring(centre);
    const double least = everything ? 0.0 : options_.least_normal_cosine;
    const glm::dvec3& from = places_[centre];
    for (std::size_t i = 0, n = ring.size(); i < n; ++i) {
      const VertexId v = ring[i];
      const VertexId w = ring[i + 1 == n ? 0 : i + 1];
      if (v == kOutside || w == kOutside || v == other || w == other) continue;
      const glm::dvec3 side = places_[w] - places_[v];
      const glm::dvec3 before = glm::cross(side, from - places_[v]);
      const glm::dvec3 after = glm::cross(side, target - places_[v]);
      const double before2 = glm::dot(before, before);
      if (before2 == 0.0) continue;
      const double d = glm::dot(before, after);
      if (d <= 0.0 || d * d < least * least * before2 * glm::dot(after, after)) return false;
    }
    return true;
  }

  void try_merge(const Candidate& best, double limit, bool everything, MergeHistory& history) {
    if (!patches_allow(best.a, best.b)) return;
    VertexId root = best.a;
    VertexId removed = best.b;
    if (patch_root_[removed] == generation_) std::swap(root, removed);
    if (patch_root_[root] == generation_ && patch_splits_[root] == kMostSplitsPerVertex) return;
    if (!rings_.can_merge(root, removed)) return;
    if (rings_.ring_size(root) + rings_.ring_size(removed) - 4 > options_.longest_ring) return;
    ParentPosition parent = cost_->propose(root, removed, places_[root], places_[removed]).parent;
    // Between two centres without a patch, the one at which the parent lies keeps its number.
    if (parent == ParentPosition::added && patch_root_[root] != generation_) {
      std::swap(root, removed);
      parent = ParentPosition::kept;
    }
    glm::dvec3 target = places_[root];
    if (parent == ParentPosition::added) target = places_[removed];
    if (parent == ParentPosition::middle) target = 0.5 * (places_[root] + places_[removed]);
    if (parent != ParentPosition::kept && !keeps_faces(root, removed, target, everything)) return;
    if (parent != ParentPosition::added && !keeps_faces(removed, root, target, everything)) return;

    if (!best.penalised && !everything) {
      Candidate again = best;
      again.cost *= coding_penalty(root, removed, target);
      again.penalised = true;
      if (again.cost > best.cost) {
        if (again.cost <= limit) push(again);
        return;
      }
    }
    const RingMesh::Wings wings = rings_.wings(root, removed);
    const double deviation = surroundings_deviation(root, removed) + merge_deviation(root, removed, target);
    // Rounded up, so that it stays a bound.
    const float bound = std::nextafter(static_cast<float>(deviation), std::numeric_limits<float>::infinity());
    history.merges.push_back({root, removed, wings.first, wings.last, parent, static_cast<float>(best.cost), bound});
    deviations_[root] = bound;
    if (parent == ParentPosition::added) halvings_[root] = halvings_[removed];
    if (parent == ParentPosition::middle) {
      halvings_[root] = static_cast<std::uint8_t>(1 + std::max(halvings_[root], halvings_[removed]));
      history.middle_depth = std::max<std::uint32_t>(history.middle_depth, halvings_[root]);
    }
    rings_.merge(root, removed);
    cost_->merged(root, removed);
    places_[root] = target;
    patch_splits_[root] = static_cast<std::uint8_t>(patch_root_[root] == generation_ ? patch_splits_[root] + 1 : 1);
    patch_root_[root] = generation_;
    ++changes_[root];
    --alive_;
    for (const VertexId w : rings_.ring(root)) {
      if (w == kOutside) continue;
      const Candidate next = judge(std::min(root, w), std::max(root, w));
      if (next.cost <= limit) push(next);
    }
  }

  // The largest deviation of a face around either centre: each face has that of its worst corner.
  double surroundings_deviation(VertexId root, VertexId removed) const {
    float worst = std::max(deviations_[root], deviations_[removed]);
    for (const VertexId centre : {root, removed}) {
      for (const VertexId w : rings_.ring(centre)) {
        if (w != kOutside) worst = std::max(worst, deviations_[w]);
      }
    }
    return worst;
  }

  double merge_deviation(VertexId root, VertexId removed, const glm::dvec3& target) {
    const auto root_ring = rings_.ring(root);
    const auto removed_ring = rings_.ring(removed);
    const std::size_t at_root = rings_.position_in_ring(removed, root);
    const std::size_t at_removed = rings_.position_in_ring(root, removed);
    merged_ring_.clear();
    std::size_t gap = static_cast<std::size_t>(-1);
    const auto add = [&](VertexId v) {
      if (v == kOutside) gap = merged_ring_.size();
      merged_ring_.push_back(v == kOutside ? target : places_[v]);
    };
    for (std::size_t i = 1; i < removed_ring.size(); ++i) add(removed_ring[(at_root + i) % removed_ring.size()]);
    for (std::size_t i = 2; i + 1 < root_ring.size(); ++i) add(root_ring[(at_removed + i) % root_ring.size()]);
    return deviation_.bound({merged_ring_, gap, removed_ring.size() - 2, places_[root], places_[removed], target});
  }

  void push(const Candidate& candidate) {
    heap_.push_back(candidate);
    std::push_heap(heap_.begin(), heap_.end(), Dearer{});
  }

  // At least 1, more for merges that take many bits: those whose arc ranks low among the arcs of its length
  // (RingGeometry::first_of_rank), and those whose hidden centre lies off the middle of its own ring.
  double coding_penalty(VertexId root, VertexId removed, const glm::dvec3& target) {
    const auto root_ring = rings_.ring(root);
    const auto removed_ring = rings_.ring(removed);
    const std::size_t at_root = rings_.position_in_ring(removed, root);
    const std::size_t at_removed = rings_.position_in_ring(root, removed);
    const std::size_t arc = removed_ring.size() - 2;  // ring steps from wing to wing
    squares_.clear();                                 // of the merged ring's spokes, from the first wing on
    glm::dvec3 middle = places_[root];
    double neighbours = 1.0;
    bool open = false;
    const auto add = [&](VertexId v, bool of_removed) {
      open |= v == kOutside;
      const glm::dvec3 spoke = v == kOutside ? glm::dvec3(0.0) : places_[v] - target;
      squares_.push_back(glm::dot(spoke, spoke));
      if (!of_removed || v == kOutside) return;
      middle += places_[v];
      neighbours += 1.0;
    };
    for (std::size_t i = 1; i < removed_ring.size(); ++i) add(removed_ring[(at_root + i) % removed_ring.size()], true);
    for (std::size_t i = 2; i + 1 < root_ring.size(); ++i) add(root_ring[(at_removed + i) % root_ring.size()], false);
    const std::size_t size = squares_.size();
    const auto reach = [&](std::size_t first) {
      double sum = -0.4 * (squares_[first] + squares_[(first + arc) % size]);
      for (std::size_t i = 1; i < arc; ++i) sum += squares_[(first + i) % size];
      return sum;
    };
    int rank = 0;
    const double own = reach(0);
    for (std::size_t first = 1; first < size && !open; ++first) rank += reach(first) > own ? 1 : 0;
    double mean_square = 0.0;
    for (const double square : squares_) mean_square += square / static_cast<double>(size);
    const glm::dvec3 off = places_[removed] - middle / neighbours;
    const double off_middle = mean_square > 0.0 ? glm::dot(off, off) / mean_square : 0.0;
    return 1.0 + options_.coding_weight * (0.3 * std::min(rank, 6) + off_middle);
  }

  const SimplifyOptions& options_;
  std::vector<glm::dvec3> places_;
  RingMesh rings_;
  std::unique_ptr<MergeCost> cost_;
  std::vector<std::uint32_t> patch_root_;  // the generation in which the vertex became a patch's root
  std::vector<std::uint8_t> patch_splits_;  // how many vertices that root has absorbed in that generation
  std::vector<std::uint32_t> changes_;
  std::vector<float> deviations_;       // by vertex: how far the faces around it may be off
  std::vector<std::uint8_t> halvings_;  // by vertex: MergeHistory::middle_depth
  std::vector<VertexId> live_;
  std::vector<Candidate> sorted_;  // this generation's first candidates
  std::size_t next_sorted_ = 0;
  std::vector<Candidate> heap_;  // those judged since
  std::vector<double> squares_;
  std::vector<glm::dvec3> merged_ring_;
  MergeDeviation deviation_;
  std::uint32_t alive_;
  std::uint32_t generation_ = 0;
};

}  // namespace

MergeHistory simplify(const TriangleMesh& mesh, const SimplifyOptions& options) {
  return Simplifier(mesh, options).run();
}

}  // namespace fanstream
