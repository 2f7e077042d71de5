#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <cstdlib>

#include "server/build/merge_cost.h"
#include "server/build/prefetch.h"
#include "server/build/quadric.h"
#include "server/build/vertex_curvature.h"

namespace fanstream {
namespace {

// Border planes count this many times their own area: a border that wanders is seen at once.
constexpr double kBoundaryWeight = 2.0;

// A middle is taken only where it costs less than this share of the better end: kept vertices stay where the original
// has them, which serves both the shape of coarser levels (measured: 0.93 against 0.98 of the RMS) and the coding.
constexpr double kMiddleGain = 0.3;

// Where a surface is flat every merge costs nothing: this share of area times squared edge length makes short edges of
// small stars go first, so that flat parts thin out evenly (a CAD model's splits take 12 % fewer bits for it).
constexpr double kEdgeShare = 4.0e-5;

// An optimum may lie this far from the middle of the edge, in edge lengths.
constexpr double kFarthest = 1.0;

// The faces' planes alone, once more: what shifting them all by the same distance needs to know.
struct PlaneSums {
  glm::dvec3 normal{0.0};  // weighted
  double offset = 0.0;     // likewise
  double weight = 0.0;
  double bend = 0.0;  // the curvature at the vertex times the square of a length: a length

  void add_plane(const glm::dvec3& n, double plane_offset, double w) {
    normal += w * n;
    offset += w * plane_offset;
    weight += w;
  }
  void add(const PlaneSums& other) {
    normal += other.normal;
    offset += other.offset;
    weight += other.weight;
  }
};

class QuadricCost final : public MergeCost {
 public:
  QuadricCost(const MeshView& view, const CostOptions& options, double evenness)
      : view_(view),
        quadrics_(view.places.size()),
        placement_(options.placement),
        memoryless_(options.quadrics == Quadrics::memoryless),
        evenness_(evenness) {
    const Bounds box = bounds_of(view.places);
    origin_ = 0.5 * (box.low + box.high);
    if (options.cost == CostKind::curvature) add_curvature(options.curvature.value_or(Curvature::mean));
    add_faces();
    add_boundary();
  }

  MergeProposal propose(VertexId root, VertexId removed) const override {
    Quadric sum = quadrics_[root];
    sum.add(quadrics_[removed]);
    const glm::dvec3 a = view_.places[root] - origin_;
    const glm::dvec3 b = view_.places[removed] - origin_;
    const double area = sum.trace();
    if (!sums_.empty()) bend(sum, root, removed, glm::dot(b - a, b - a));
    MergeProposal best{std::fabs(sum.at(a)), ParentPosition::kept};
    const double at_removed = std::fabs(sum.at(b));
    if (at_removed < best.cost) best = {at_removed, ParentPosition::added};
    if (placement_ == Placement::ends_middle) {
      const double at_middle = std::fabs(sum.at(0.5 * (a + b)));
      if (at_middle < kMiddleGain * best.cost) best = {at_middle, ParentPosition::middle};
    } else if (placement_ != Placement::end) {
      place_freely(sum, a, b, best);
    }
    const glm::dvec3 edge = b - a;
    best.cost = evened(best.cost, area) + evened(kEdgeShare * glm::dot(edge, edge) * area, area);
    return best;
  }

  void fetch(std::span<const VertexId> vertices) const override {
    for (const VertexId v : vertices) {
      if (v == kOutside) continue;
      prefetch(&quadrics_[v].xx);
      prefetch(&quadrics_[v].c);
      if (!sums_.empty()) prefetch(&sums_[v]);
    }
  }

  void merged(VertexId root, VertexId removed, ParentPosition parent) override {
    if (!sums_.empty()) {
      PlaneSums& sums = sums_[root];
      if (parent == ParentPosition::added) sums.bend = sums_[removed].bend;
      if (parent == ParentPosition::middle || parent == ParentPosition::free) {
        sums.bend = 0.5 * (sums.bend + sums_[removed].bend);
      }
    }
    if (memoryless_) {
      take_present_faces(root);
      for (const VertexId w : view_.rings.ring(root)) {
        if (w != kOutside) take_present_faces(w);
      }
      return;
    }
    quadrics_[root].add(quadrics_[removed]);
    if (!sums_.empty()) sums_[root].add(sums_[removed]);
  }

  bool looks_around() const override { return memoryless_; }

 private:
  // Times the mean square distance to the power of evenness.
  double evened(double sum, double area) const {
    return evenness_ > 0.0 && area > 0.0 ? sum * std::pow(sum / area, evenness_) : sum;
  }

  void place_freely(const Quadric& sum, const glm::dvec3& a, const glm::dvec3& b, MergeProposal& best) const {
    const auto consider = [&](const glm::dvec3& place) {
      const double cost = std::fabs(sum.at(place));
      if (!(cost < best.cost)) return;
      best = {cost, ParentPosition::free, place + origin_};
    };
    const glm::dvec3 u = b - a;
    if (placement_ == Placement::optimal) {
      const glm::dvec3 middle = 0.5 * (a + b);
      const std::optional<glm::dvec3> place = least_anywhere(sum, middle);
      if (place && glm::dot(*place - middle, *place - middle) <= kFarthest * kFarthest * glm::dot(u, u)) {
        consider(*place);
        return;
      }
    }
    const std::optional<double> k = least_on_line(sum, a, u);
    if (k && *k > 0.0 && *k < 1.0) consider(a + *k * u);  // else the better end, where clamping puts it
  }

  // Shifts the faces' planes by what the ends' curvature amounts to.
  void bend(Quadric& sum, VertexId root, VertexId removed, double edge2) const {
    const PlaneSums& a = sums_[root];
    const PlaneSums& b = sums_[removed];
    static const int mode = getenv("CURV_MODE") ? atoi(getenv("CURV_MODE")) : 1;
    static const double scale = getenv("CURV_SCALE") ? atof(getenv("CURV_SCALE")) : 1.0;
    static const int local = getenv("CURV_LOCAL") ? atoi(getenv("CURV_LOCAL")) : 0;
    double s = local ? scale * edge2 / mean_edge2_ : scale;
    if (mode == 3) {
      const double h = s * (std::fabs(a.bend) + std::fabs(b.bend));
      sum.c += (a.weight + b.weight) * h * h;
      return;
    }
    if (mode == 4) s = -s;
    const double h = s * (a.bend + b.bend);
    const glm::dvec3 n = a.normal + b.normal;
    sum.bx += h * n.x;
    sum.by += h * n.y;
    sum.bz += h * n.z;
    sum.c += h * (2.0 * (a.offset + b.offset) + (a.weight + b.weight) * h);
  }

  void add_curvature(Curvature which) {
    sums_.resize(quadrics_.size());
    double edges2 = 0.0;
    double edges = 0.0;
    for (const Triangle& t : view_.original.triangles) {
      for (int i = 0; i < 3; ++i) {
        const glm::dvec3 edge = view_.places[t[(i + 1) % 3]] - view_.places[t[i]];
        edges2 += glm::dot(edge, edge);
        edges += 1.0;
      }
    }
    mean_edge2_ = edges2 / edges;
    const double cap = std::sqrt(mean_edge2_);
    const std::vector<double> curvature = vertex_curvature(view_.rings, view_.places, which);
    const double unit = which == Curvature::gaussian ? mean_edge2_ * cap : mean_edge2_;
    for (VertexId v = 0; v < sums_.size(); ++v) sums_[v].bend = std::clamp(curvature[v] * unit, -10*cap, 10*cap);
  }

  void add_face(const Triangle& t, const glm::dvec3& p0, const glm::dvec3& p1, const glm::dvec3& p2,
                std::span<const VertexId> to) {
    const glm::dvec3 normal = glm::cross(p1 - p0, p2 - p0);
    const double length = glm::length(normal);
    if (length == 0.0) return;
    (void)t;
    const glm::dvec3 n = normal / length;
    const double offset = -glm::dot(n, p0 - origin_);
    Quadric q;
    q.add_plane(n, offset, 0.5 * length);
    for (const VertexId v : to) quadrics_[v].add(q);
    if (sums_.empty()) return;
    for (const VertexId v : to) sums_[v].add_plane(n, offset, 0.5 * length);
  }

  void add_faces() {
    const std::vector<glm::dvec3>& places = view_.places;
    for (const Triangle& t : view_.original.triangles) add_face(t, places[t[0]], places[t[1]], places[t[2]], t);
  }

  void add_boundary() {
    for (VertexId v = 0; v < view_.places.size(); ++v) {
      const auto ring = view_.rings.ring(v);
      const std::uint32_t gap = view_.rings.position_in_ring(v, kOutside);
      const auto size = static_cast<std::uint32_t>(ring.size());
      if (gap == size) continue;
      const VertexId b = ring[(gap + 1) % size];
      const VertexId ends[] = {v, b};
      add_boundary_edge(v, b, ring[(gap + 2) % size], ends);
    }
  }

  void add_boundary_edge(VertexId a, VertexId b, VertexId opposite, std::span<const VertexId> to) {
    const std::vector<glm::dvec3>& places = view_.places;
    const glm::dvec3 along = places[b] - places[a];
    const glm::dvec3 face = glm::cross(along, places[opposite] - places[a]);
    const glm::dvec3 upright = glm::cross(along, face);
    const double length = glm::length(upright);
    if (length == 0.0) return;
    const glm::dvec3 n = upright / length;
    Quadric q;
    q.add_plane(n, -glm::dot(n, places[a] - origin_), kBoundaryWeight * glm::dot(along, along));
    for (const VertexId v : to) quadrics_[v].add(q);
  }

  void take_present_faces(VertexId v) {
    quadrics_[v] = {};
    if (!sums_.empty()) sums_[v] = {.bend = sums_[v].bend};
    const auto ring = view_.rings.ring(v);
    const std::size_t size = ring.size();
    const VertexId only[] = {v};
    for (std::size_t i = 0; i < size; ++i) {
      const VertexId w = ring[i];
      const VertexId next = ring[(i + 1) % size];
      if (w == kOutside) {
        add_boundary_edge(v, next, ring[(i + 2) % size], only);
      } else if (next == kOutside) {
        add_boundary_edge(v, w, ring[(i + size - 1) % size], only);
      } else {
        add_face({v, w, next}, view_.places[v], view_.places[w], view_.places[next], only);
      }
    }
  }

  MeshView view_;
  std::vector<Quadric> quadrics_;
  std::vector<PlaneSums> sums_;  // of the curvature cost
  glm::dvec3 origin_{0.0};
  Placement placement_;
  bool memoryless_;
  double evenness_;
  double mean_edge2_ = 0.0;
};

}  // namespace

std::unique_ptr<MergeCost> make_quadric_cost(const MeshView& view, const CostOptions& options, double evenness) {
  return std::make_unique<QuadricCost>(view, options, evenness);
}

}  // namespace fanstream
