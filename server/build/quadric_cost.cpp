#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <optional>
#include <type_traits>

#include "common/geometry/quadric.h"
#include "common/support/cache_lines.h"
#include "server/build/merge_cost.h"
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
constexpr double kEdgeShare = 2e-4;

// An optimum may lie this far from the middle of the edge, in edge lengths.
constexpr double kFarthest = 1.0;

// The planes are shifted by (H1 + H2) |u|^2 / 128: a surface of that curvature rises by a quarter of this over an edge
// u at its middle (|H| as vertex_curvature has it is 2/r on a sphere), so it is little where edges are short, and grows
// as they do. By K |u|^3 / 128 for the gaussian curvature. At most by an eighth of the edge, whatever sharp corners
// say.
constexpr double kBend = 1.0 / 128.0;
constexpr double kMostBend = 1.0 / 8.0;

// What a vertex stands for.
struct Planes {
  Quadric quadric;
  void add_face(const glm::dvec3& n, double offset, double weight) { quadric.add_plane(n, offset, weight); }
  void add(const Planes& other) { quadric.add(other.quadric); }
  void clear() { quadric = {}; }
};

// The same where curvature shifts the faces' planes: what shifting all of them by one distance needs to know.
struct alignas(64) CurvedPlanes {
  Quadric quadric;
  glm::dvec3 normal{0.0};  // weighted sums over the faces' planes
  double offset = 0.0;
  double weight = 0.0;
  double curvature = 0.0;  // at the vertex, as the original had it

  void add_face(const glm::dvec3& n, double plane_offset, double w) {
    quadric.add_plane(n, plane_offset, w);
    normal += w * n;
    offset += w * plane_offset;
    weight += w;
  }
  void add(const CurvedPlanes& other) {
    quadric.add(other.quadric);
    normal += other.normal;
    offset += other.offset;
    weight += other.weight;
  }
  void clear() { *this = {{}, glm::dvec3(0.0), 0.0, 0.0, curvature}; }
};
static_assert(sizeof(CurvedPlanes) == 128);

template <class VertexPlanes>
class QuadricCost final : public MergeCost {
 public:
  QuadricCost(const MeshView& view, const CostOptions& options, double evenness)
      : view_(view),
        planes_(view.places.size()),
        placement_(options.placement),
        memoryless_(options.quadrics.value_or(CostOptions::kUsualQuadrics) == Quadrics::memoryless),
        evenness_(evenness) {
    const Bounds box = bounds_of(view.places);
    origin_ = 0.5 * (box.low + box.high);
    if constexpr (kCurved) add_curvature(options.curvature.value_or(Curvature::mean));
    for (const Triangle& t : view.original.triangles) add_face(t);
    add_boundary();
    if (!memoryless_) return;
    alive_.resize(planes_.size());
    std::iota(alive_.begin(), alive_.end(), VertexId{0});
  }

  MergeProposal propose(VertexId root, VertexId removed) const override {
    Quadric sum = planes_[root].quadric;
    sum.add(planes_[removed].quadric);
    const glm::dvec3 a = view_.places[root] - origin_;
    const glm::dvec3 b = view_.places[removed] - origin_;
    const double area = sum.trace();
    if constexpr (kCurved) bend(sum, planes_[root], planes_[removed], glm::dot(b - a, b - a));
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
    best.cost = finite(evened(best.cost, area) + evened(kEdgeShare * glm::dot(edge, edge) * area, area));
    return best;
  }

  bool proposes_side_by_side() const override { return true; }

  void fetch(std::span<const VertexId> vertices) const override {
    for (const VertexId v : vertices) {
      if (v == kOutside) continue;
      fetch_line(&planes_[v].quadric.xx);
      fetch_line(&planes_[v].quadric.c);
    }
  }

  void merged(VertexId root, VertexId removed, [[maybe_unused]] ParentPosition parent) override {
    planes_[root].add(planes_[removed]);
    if constexpr (kCurved) {
      double& curvature = planes_[root].curvature;
      const double other = planes_[removed].curvature;
      if (parent == ParentPosition::added) curvature = other;
      if (parent == ParentPosition::middle || parent == ParentPosition::free) curvature = 0.5 * (curvature + other);
    }
  }

  bool begin_generation() override {
    if (!memoryless_) return false;
    std::erase_if(alive_, [&](VertexId v) { return !view_.rings.contains(v); });
    for (const VertexId v : alive_) planes_[v].clear();
    for (const VertexId v : alive_) add_present_faces(v);
    return true;
  }

 private:
  static constexpr bool kCurved = std::is_same_v<VertexPlanes, CurvedPlanes>;

  // Squares of the largest coordinates overflow: then all merges cost the same.
  static double finite(double cost) {
    constexpr double kMost = std::numeric_limits<double>::max();
    return cost <= kMost ? cost : kMost;
  }

  // Times the mean square distance to the power of evenness, for which most models have a small whole number.
  double evened(double sum, double area) const {
    if (!(evenness_ > 0.0 && area > 0.0)) return sum;
    const double mean = sum / area;
    if (evenness_ == 1.0) return sum * mean;
    if (evenness_ == 2.0) return sum * (mean * mean);
    if (evenness_ == 4.0) return sum * ((mean * mean) * (mean * mean));
    return sum * std::pow(mean, evenness_);
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

  // Shifts the faces' planes by what the ends' curvature amounts to over the edge.
  void bend(Quadric& sum, const VertexPlanes& a, const VertexPlanes& b, double edge2) const {
    double turn = kBend * (a.curvature + b.curvature);  // shift over squared edge
    if (curvature_ == Curvature::gaussian) turn *= std::sqrt(edge2);
    const bool is_sharp = turn * turn * edge2 > kMostBend * kMostBend;
    const double h = is_sharp ? std::copysign(kMostBend * std::sqrt(edge2), turn) : turn * edge2;
    const glm::dvec3 n = a.normal + b.normal;
    sum.bx += h * n.x;
    sum.by += h * n.y;
    sum.bz += h * n.z;
    sum.c += h * (2.0 * (a.offset + b.offset) + (a.weight + b.weight) * h);
  }

  void add_curvature(Curvature which) {
    curvature_ = which;
    const std::vector<double> curvature = vertex_curvature(view_.original, view_.rings, which);
    for (VertexId v = 0; v < planes_.size(); ++v) planes_[v].curvature = curvature[v];
  }

  void add_face(const Triangle& t) {
    const glm::dvec3& p = view_.places[t[0]];
    const glm::dvec3 normal = glm::cross(view_.places[t[1]] - p, view_.places[t[2]] - p);
    const double length = glm::length(normal);
    if (length == 0.0) return;
    const glm::dvec3 n = normal / length;
    const double offset = -glm::dot(n, p - origin_);
    VertexPlanes face;
    face.add_face(n, offset, 0.5 * length);
    for (const VertexId v : t) planes_[v].add(face);
  }

  void add_boundary() {
    for (VertexId v = 0; v < view_.places.size(); ++v) {
      const auto ring = view_.rings.ring(v);
      const std::uint32_t gap = view_.rings.position_in_ring(v, kOutside);
      const auto size = static_cast<std::uint32_t>(ring.size());
      if (gap == size) continue;
      add_boundary_edge(v, ring[(gap + 1) % size], ring[(gap + 2) % size]);
    }
  }

  void add_boundary_edge(VertexId a, VertexId b, VertexId opposite) {
    const std::vector<glm::dvec3>& places = view_.places;
    const glm::dvec3 along = places[b] - places[a];
    const glm::dvec3 face = glm::cross(along, places[opposite] - places[a]);
    const glm::dvec3 upright = glm::cross(along, face);
    const double length = glm::length(upright);
    if (length == 0.0) return;
    const glm::dvec3 n = upright / length;
    Quadric q;
    q.add_plane(n, -glm::dot(n, places[a] - origin_), kBoundaryWeight * glm::dot(along, along));
    planes_[a].quadric.add(q);
    planes_[b].quadric.add(q);
  }

  // Those of which v is the smallest corner, and the boundary edge from it.
  void add_present_faces(VertexId v) {
    const auto ring = view_.rings.ring(v);
    const std::size_t size = ring.size();
    for (std::size_t i = 0; i < size; ++i) {
      const VertexId w = ring[i];
      const VertexId next = ring[i + 1 == size ? 0 : i + 1];
      if (w == kOutside) {
        add_boundary_edge(v, next, ring[(i + 2) % size]);
      } else if (next != kOutside && v < w && v < next) {
        add_face({v, w, next});
      }
    }
  }

  MeshView view_;
  std::vector<VertexPlanes> planes_;
  std::vector<VertexId> alive_;  // of the memoryless: what may still be in the mesh, ascending
  Curvature curvature_ = Curvature::mean;
  glm::dvec3 origin_{0.0};
  Placement placement_;
  bool memoryless_;
  double evenness_;
};

}  // namespace

std::unique_ptr<MergeCost> make_quadric_cost(const MeshView& view, const CostOptions& options, double evenness) {
  if (options.cost == CostKind::curvature) {
    return std::make_unique<QuadricCost<CurvedPlanes>>(view, options, evenness);
  }
  return std::make_unique<QuadricCost<Planes>>(view, options, evenness);
}

}  // namespace fanstream
