#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>

#include "server/build/merge_cost.h"
#include "server/build/point_assignment.h"

namespace fanstream {
namespace {

// What the energy grows by: E_dist + E_spring of Suzuki, Okamoto, Kanai, after Hoppe, DeRose, Duchamp, McDonald, Stuetzle,
// "Mesh optimization", 1993.
class FansCost final : public MergeCost {
 public:
  FansCost(const MeshView& view, const CostOptions& options)
      : view_(view),
        points_(view.original, options.samples.value_or(0), options.seed),
        placement_(options.placement),
        kappa_(options.kappa.value_or(CostOptions::kUsualKappa)) {
    double squares = 0.0;
    for (const Triangle& t : view.original.triangles) {
      for (std::size_t i = 0; i < 3; ++i) squares += squared(view.places[t[(i + 1) % 3]] - view.places[t[i]]);
    }
    const double mean = squares / (3.0 * static_cast<double>(std::max<std::size_t>(1, view.original.triangles.size())));
    nothing_ = mean > 0.0 && std::isfinite(mean) ? 1e-6 * mean : 1.0;
  }

  MergeProposal propose(VertexId root, VertexId removed) const override {
    points_.gather(root, removed, around_);
    find_springs(root, removed);
    const glm::dvec3 a = view_.places[root];
    const glm::dvec3 b = view_.places[removed];
    Best best{energy(a, kNoLimit), ParentPosition::kept, a};
    offer(b, ParentPosition::added, best);
    if (placement_ != Placement::end) {
      // The paper's choice, and where a free parent is looked for from.
      const Best ends = best;
      offer(0.5 * (a + b), ParentPosition::middle, best);
      if (placement_ != Placement::ends_middle) {
        const Best start = best;
        best = ends;
        search(a, b, start, best);
      }
    }
    return {above_zero(best.energy - around_.squares - springs_before_), best.parent, best.place};
  }

  void merged(VertexId root, VertexId removed, ParentPosition /*parent*/) override {
    points_.merge(root, removed, view_.places);
  }

  bool begin_generation() override { return true; }

 private:
  static constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  static constexpr int kSteps = 3;  // of the search for a free place

  struct Best {
    double energy;
    ParentPosition parent;
    glm::dvec3 place;
  };

  static double squared(const glm::dvec3& v) { return glm::dot(v, v); }

  // Costs have to be positive; what lowers the energy comes first, the most first.
  double above_zero(double growth) const {
    const double x = growth / nothing_;
    const double cost = x >= 0.0 ? 1.0 + x : 1.0 / (1.0 - x);
    return cost < std::numeric_limits<double>::max() ? cost : std::numeric_limits<double>::max();
  }

  // The neighbours of the parent, and the energy of the edges that the merge takes away or moves.
  void find_springs(VertexId root, VertexId removed) const {
    neighbours_.clear();
    springs_before_ = 0.0;
    if (kappa_ == 0.0) return;
    for (const VertexId end : {root, removed}) {
      for (const VertexId w : view_.rings.ring(end)) {
        if (w == kOutside || (end == removed && w == root)) continue;
        springs_before_ += kappa_ * squared(view_.places[w] - view_.places[end]);
        if (w == removed) continue;
        if (end == root || view_.rings.position_in_ring(root, w) == view_.rings.ring_size(root)) neighbours_.push_back(w);
      }
    }
  }

  double energy(const glm::dvec3& place, double limit) const {
    double sum = 0.0;
    for (const VertexId w : neighbours_) sum += kappa_ * squared(view_.places[w] - place);
    star_.assign(around_.rest, place, view_.places);
    if (star_.is_empty()) return sum;
    for (std::size_t i = 0; i < around_.points.size() && sum < limit; ++i) {
      sum += star_.nearest(points_.point(around_.points[i])).squared;
    }
    return sum;
  }

  void offer(const glm::dvec3& place, ParentPosition parent, Best& best) const {
    const double here = energy(place, best.energy);
    if (here < best.energy) best = {here, parent, place};
  }

  // With every point's nearest face and its place on it held fast, the energy is least in one place, and on the edge in
  // the place beside that.
  void search(const glm::dvec3& a, const glm::dvec3& b, const Best& start, Best& best) const {
    Best found = start;
    const glm::dvec3 u = b - a;
    for (int step = 0; step < kSteps; ++step) {
      std::optional<glm::dvec3> place = least_with_faces_fixed(found.place);
      if (!place) break;
      if (placement_ == Placement::segment || squared(*place - 0.5 * (a + b)) > squared(u)) {
        if (!(squared(u) > 0.0)) break;
        place = a + std::clamp(glm::dot(*place - a, u) / squared(u), 0.0, 1.0) * u;
      }
      const double before = found.energy;
      offer(*place, ParentPosition::free, found);
      if (!(found.energy < before)) break;
    }
    if (found.energy < best.energy) best = {found.energy, ParentPosition::free, found.place};
  }

  std::optional<glm::dvec3> least_with_faces_fixed(const glm::dvec3& centre) const {
    glm::dvec3 sum(0.0);
    double weight = kappa_ * static_cast<double>(neighbours_.size());
    for (const VertexId w : neighbours_) sum += kappa_ * view_.places[w];
    star_.assign(around_.rest, centre, view_.places);
    for (std::size_t i = 0; i < around_.points.size() && !star_.is_empty(); ++i) {
      const glm::dvec3& x = points_.point(around_.points[i]);
      const PointAssignment::Star::Nearest at = star_.nearest(x);
      const double share = star_.share_of_centre(at);
      sum += share * (x - (at.place - share * centre));
      weight += share * share;
    }
    const glm::dvec3 place = sum / weight;
    if (!(weight > 0.0) || !std::isfinite(place.x + place.y + place.z)) return std::nullopt;
    return place;
  }

  MeshView view_;
  PointAssignment points_;
  Placement placement_;
  double kappa_;
  double nothing_ = 1.0;  // an energy that does not matter
  // Of the edge at hand; kept to save allocation.
  mutable PointAssignment::Surroundings around_;
  mutable PointAssignment::Star star_;
  mutable std::vector<VertexId> neighbours_;
  mutable double springs_before_ = 0.0;
};

}  // namespace

std::unique_ptr<MergeCost> make_fans_cost(const MeshView& view, const CostOptions& options) {
  return std::make_unique<FansCost>(view, options);
}

std::unique_ptr<MergeCost> make_merge_cost(const MeshView& view, const CostOptions& options, double evenness) {
  return options.cost == CostKind::fans ? make_fans_cost(view, options) : make_quadric_cost(view, options, evenness);
}

}  // namespace fanstream
