#include "client/subdivide/adaptive_subdivision.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "client/subdivide/point4.h"
#include "client/subdivide/polygon_topology.h"

namespace fanstream {
namespace {

// A half-edge at a finished face.
constexpr CornerId kBorder = kBoundary - 1;
constexpr bool is_half_edge(CornerId c) { return c < kBorder; }

// Sums over the faces around some vertices.
class VertexStars {
 public:
  struct Star {
    VertexId vertex;
    Point4 sum;       // of face points and next vertices
    Point4 boundary;  // of the two neighbours along the boundary
    std::uint32_t faces = 0;
    bool at_boundary = false;

    // (Q + 2 R + (n - 3) S) / n with the means written as sums, so that a weight of 1 stays 1.
    Point4 moved(const Point4& old, BoundaryRule rule) const {
      const double n = faces;
      if (!at_boundary) return old + (sum - old * (2.0 * n)) * (1.0 / (n * n));
      return faces == 1 && rule == BoundaryRule::corners ? old : (old * 6.0 + boundary) * 0.125;
    }
  };

  explicit VertexStars(std::size_t vertices) : slots_(vertices, kNone) {}

  void want(VertexId v) {
    if (slots_[v] != kNone) return;
    slots_[v] = static_cast<std::uint32_t>(stars_.size());
    stars_.push_back({v, {}, {}});
  }
  bool wanted(VertexId v) const { return slots_[v] != kNone; }
  void add_face(VertexId v, const Point4& sum) {
    Star& star = stars_[slots_[v]];
    star.sum = star.sum + sum;
    ++star.faces;
  }
  void add_boundary(VertexId v, const Point4& neighbor) {
    Star& star = stars_[slots_[v]];
    star.boundary = star.boundary + neighbor;
    star.at_boundary = true;
  }
  const std::vector<Star>& all() const { return stars_; }

 private:
  static constexpr std::uint32_t kNone = ~0U;
  std::vector<std::uint32_t> slots_;
  std::vector<Star> stars_;
};

}  // namespace

// The faces of one half-step, while it is made.
class AdaptiveSubdivision::Step {
 public:
  Step(AdaptiveSubdivision& owner, std::span<const std::uint8_t> chosen) : s_(owner), odd_(owner.next_is_odd()) {
    refined_.resize(s_.active_count());
    for (FaceId f = 0; f < refined_.size(); ++f) refined_[f] = chosen[f] != 0 && s_.refinable_[f] != 0;
  }

  std::uint64_t corners_afterwards() const;
  void run();

 private:
  enum class EdgeKind : std::uint8_t { shared, filler, boundary };
  EdgeKind kind(CornerId c) const {
    const CornerId twin = s_.twins_[c];
    if (twin == kBoundary) return EdgeKind::boundary;
    return twin == kBorder || refined_[s_.corner_faces_[twin]] == 0 ? EdgeKind::filler : EdgeKind::shared;
  }
  CornerId next(CornerId c) const {
    const FaceId f = s_.corner_faces_[c];
    return next_corner(c, s_.begins_[f], s_.begins_[f + 1]);
  }
  Point4 old_point(VertexId v) const { return load(s_.points_[v]); }

  void add_centers();
  void add_faces();
  void add_shared(CornerId c);
  void add_boundary(CornerId c);
  void finish_face(std::span<const VertexId> corners, unsigned depth, FaceId origin);
  void begin_face(FaceId origin, const Point4& edge_point);
  void join_spokes();
  void mark_refinable();

  AdaptiveSubdivision& s_;
  const bool odd_;
  std::vector<std::uint8_t> refined_;
  std::vector<VertexId> centers_;  // of refined faces
  // Of each corner of a refined face: the new half-edge from its vertex to the face's centre, and the one back.
  std::vector<CornerId> inward_, outward_;
  std::vector<std::uint32_t> begins_ = {0U};
  std::vector<VertexId> corners_;
  std::vector<FaceId> origins_;
  std::vector<glm::dvec4> edge_points_;
  std::vector<CornerId> twins_;
};

std::uint64_t AdaptiveSubdivision::Step::corners_afterwards() const {
  std::uint64_t count = s_.finished_corners_.size();
  for (FaceId f = 0; f < refined_.size(); ++f) {
    if (refined_[f] == 0) {
      count += s_.begins_[f + 1] - s_.begins_[f];
      continue;
    }
    for (CornerId c = s_.begins_[f]; c < s_.begins_[f + 1]; ++c) {
      switch (kind(c)) {
        case EdgeKind::shared: count += 2; break;  // half of a quad
        case EdgeKind::filler: count += 3; break;
        case EdgeKind::boundary: count += odd_ ? 3 : 0; break;
      }
    }
  }
  return count;
}

void AdaptiveSubdivision::Step::add_centers() {
  centers_.assign(refined_.size(), 0);
  for (FaceId f = 0; f < refined_.size(); ++f) {
    if (refined_[f] == 0) continue;
    centers_[f] = static_cast<VertexId>(s_.points_.size());
    s_.points_.push_back(odd_ ? s_.centroid(f) : s_.edge_points_[f]);
  }
}

void AdaptiveSubdivision::Step::finish_face(std::span<const VertexId> corners, unsigned depth, FaceId origin) {
  s_.finished_corners_.insert(s_.finished_corners_.end(), corners.begin(), corners.end());
  s_.finished_begins_.push_back(static_cast<std::uint32_t>(s_.finished_corners_.size()));
  s_.finished_depths_.push_back(static_cast<std::uint8_t>(depth));
  s_.finished_origins_.push_back(origin);
}

void AdaptiveSubdivision::Step::begin_face(FaceId origin, const Point4& edge_point) {
  origins_.push_back(origin);
  if (odd_) store(edge_points_.emplace_back(), edge_point);
}

// Half-edges a, m2, b, m1 of the quad along the edge from a to b, where m1 and m2 are the centres on its two sides.
void AdaptiveSubdivision::Step::add_shared(CornerId c) {
  const CornerId twin = s_.twins_[c];
  if (twin < c) return;
  const FaceId f = s_.corner_faces_[c];
  const FaceId g = s_.corner_faces_[twin];
  const VertexId a = s_.corners_[c];
  const VertexId b = s_.corners_[twin];
  const auto begin = static_cast<CornerId>(corners_.size());
  corners_.insert(corners_.end(), {a, centers_[g], b, centers_[f]});
  begins_.push_back(begin + 4);
  inward_[next(twin)] = begin;
  outward_[twin] = begin + 1;
  inward_[next(c)] = begin + 2;
  outward_[c] = begin + 3;
  begin_face(s_.origins_[f], (old_point(a) + old_point(centers_[f]) + old_point(b) + old_point(centers_[g])) * 0.25);
}

// Before an even step the edge point lies on the boundary edge and leaves no triangle there.
void AdaptiveSubdivision::Step::add_boundary(CornerId c) {
  outward_[c] = kBoundary;
  inward_[next(c)] = kBoundary;
  if (!odd_) return;
  const FaceId f = s_.corner_faces_[c];
  const VertexId a = s_.corners_[c];
  const VertexId b = s_.corners_[next(c)];
  const auto begin = static_cast<CornerId>(corners_.size());
  corners_.insert(corners_.end(), {a, b, centers_[f]});
  begins_.push_back(begin + 3);
  inward_[next(c)] = begin + 1;
  outward_[c] = begin + 2;
  begin_face(s_.origins_[f], (old_point(a) + old_point(b)) * 0.5);
}

void AdaptiveSubdivision::Step::add_faces() {
  inward_.assign(s_.corners_.size(), kBorder);
  outward_.assign(s_.corners_.size(), kBorder);
  for (FaceId f = 0; f < refined_.size(); ++f) {
    if (refined_[f] == 0) {
      finish_face(s_.active_face(f), s_.depth_, s_.origins_[f]);
      continue;
    }
    for (CornerId c = s_.begins_[f]; c < s_.begins_[f + 1]; ++c) {
      switch (kind(c)) {
        case EdgeKind::shared: add_shared(c); break;
        case EdgeKind::boundary: add_boundary(c); break;
        case EdgeKind::filler:
          finish_face(std::array{s_.corners_[c], s_.corners_[next(c)], centers_[f]}, s_.depth_ + 1, s_.origins_[f]);
          break;
      }
    }
  }
}

void AdaptiveSubdivision::Step::join_spokes() {
  twins_.assign(corners_.size(), kBoundary);
  for (CornerId c = 0; c < s_.corners_.size(); ++c) {
    if (is_half_edge(inward_[c])) twins_[inward_[c]] = outward_[c];
    if (is_half_edge(outward_[c])) twins_[outward_[c]] = inward_[c];
  }
}

void AdaptiveSubdivision::Step::mark_refinable() {
  s_.refinable_.assign(s_.active_count(), 1);
  if (!s_.next_is_odd()) return;
  std::vector<std::uint8_t> incomplete(s_.points_.size(), 0);
  for (CornerId c = 0; c < s_.corners_.size(); ++c) {
    if (s_.twins_[c] != kBorder) continue;
    incomplete[s_.corners_[c]] = 1;
    incomplete[s_.corners_[next(c)]] = 1;
  }
  for (FaceId f = 0; f < s_.active_count(); ++f) {
    for (const VertexId v : s_.active_face(f)) {
      if (incomplete[v] != 0) s_.refinable_[f] = 0;
    }
  }
}

void AdaptiveSubdivision::Step::run() {
  const std::vector<Move> moves = odd_ ? s_.moves(refined_) : std::vector<Move>();
  add_centers();
  add_faces();  // reads the vertices as they were
  for (const Move& move : moves) s_.points_[move.vertex] = move.target;
  join_spokes();
  s_.begins_ = std::move(begins_);
  s_.corners_ = std::move(corners_);
  s_.twins_ = std::move(twins_);
  s_.origins_ = std::move(origins_);
  s_.edge_points_ = std::move(edge_points_);
  s_.corner_faces_.resize(s_.corners_.size());
  for (FaceId f = 0; f < s_.active_count(); ++f) {
    for (CornerId c = s_.begins_[f]; c < s_.begins_[f + 1]; ++c) s_.corner_faces_[c] = f;
  }
  ++s_.depth_;
  mark_refinable();
}

glm::dvec4 AdaptiveSubdivision::centroid(FaceId f) const {
  Point4 sum;
  for (const VertexId v : active_face(f)) sum = sum + load(points_[v]);
  glm::dvec4 result;
  store(result, sum * (1.0 / static_cast<double>(active_face(f).size())));
  return result;
}

std::vector<AdaptiveSubdivision::Move> AdaptiveSubdivision::moves(const std::vector<std::uint8_t>& marked) const {
  VertexStars stars(points_.size());
  for (FaceId f = 0; f < active_count(); ++f) {
    if (marked[f] == 0) continue;
    for (const VertexId v : active_face(f)) stars.want(v);
  }
  for (FaceId f = 0; f < active_count(); ++f) {
    const std::span<const VertexId> face = active_face(f);
    if (std::none_of(face.begin(), face.end(), [&](VertexId v) { return stars.wanted(v); })) continue;
    const Point4 middle = load(centroid(f));
    for (std::size_t k = 0; k < face.size(); ++k) {
      const VertexId to = face[k + 1 == face.size() ? 0 : k + 1];
      const Point4 from_point = load(points_[face[k]]);
      const Point4 to_point = load(points_[to]);
      if (stars.wanted(face[k])) stars.add_face(face[k], middle + to_point);
      if (!at_boundary(f, k)) continue;
      if (stars.wanted(face[k])) stars.add_boundary(face[k], to_point);
      if (stars.wanted(to)) stars.add_boundary(to, from_point);
    }
  }
  std::vector<Move> result;
  result.reserve(stars.all().size());
  for (const VertexStars::Star& star : stars.all()) {
    result.push_back({star.vertex, {}});
    store(result.back().target, star.moved(load(points_[star.vertex]), options_.boundary));
  }
  return result;
}

std::vector<glm::dvec4> AdaptiveSubdivision::next_points() const {
  std::vector<glm::dvec4> result = points_;
  if (!next_is_odd()) return result;
  for (const Move& move : moves(refinable_)) result[move.vertex] = move.target;
  return result;
}

Result<AdaptiveSubdivision> AdaptiveSubdivision::create(const PolygonMesh& mesh, const SubdivisionOptions& options) {
  Result<std::vector<CornerId>> twins = half_edge_twins(mesh);
  if (!twins) return tl::unexpected(twins.error());
  AdaptiveSubdivision result;
  result.options_ = options;
  result.points_ = mesh.points;
  result.begins_ = mesh.face_begins;
  result.corners_ = mesh.corners;
  result.twins_ = std::move(*twins);
  result.corner_faces_.resize(mesh.corners.size());
  result.origins_.resize(mesh.face_count());
  result.refinable_.assign(mesh.face_count(), 1);
  for (FaceId f = 0; f < mesh.face_count(); ++f) {
    result.origins_[f] = f;
    for (CornerId c = mesh.face_begins[f]; c < mesh.face_begins[f + 1]; ++c) result.corner_faces_[c] = f;
  }
  return result;
}

FaceId AdaptiveSubdivision::active_neighbor(FaceId f, std::size_t k) const {
  const CornerId twin = twins_[begins_[f] + k];
  return is_half_edge(twin) ? corner_faces_[twin] : kNoFace;
}

bool AdaptiveSubdivision::at_boundary(FaceId f, std::size_t k) const { return twins_[begins_[f] + k] == kBoundary; }

void AdaptiveSubdivision::add_ring(std::vector<std::uint8_t>& chosen) const {
  std::vector<std::uint8_t> near(points_.size(), 0);
  for (FaceId f = 0; f < active_count(); ++f) {
    if (chosen[f] == 0) continue;
    for (const VertexId v : active_face(f)) near[v] = 1;
  }
  for (FaceId f = 0; f < active_count(); ++f) {
    for (const VertexId v : active_face(f)) chosen[f] |= near[v];
  }
}

void AdaptiveSubdivision::add_second_neighbors(std::vector<std::uint8_t>& chosen) const {
  for (int round = 0; round < 2; ++round) {
    const std::vector<std::uint8_t> before = chosen;
    for (FaceId f = 0; f < active_count(); ++f) {
      for (std::size_t k = 0; k < active_face(f).size(); ++k) {
        const FaceId g = active_neighbor(f, k);
        if (g != kNoFace && before[g] != 0) chosen[f] = 1;
      }
    }
  }
}

// An odd face q = (a, G, b, F) is put into the quads (a, q, F, q') of its spokes. Such a quad can be refined if all odd
// faces around a and F and all neighbours of q and q' have been. What is around a quad lies in odd faces around q.
void AdaptiveSubdivision::add_support(std::vector<std::uint8_t>& chosen, unsigned further_steps) const {
  const unsigned steps = std::min(further_steps, 2U);
  if (steps == 0) return;
  if (next_is_odd()) {
    for (unsigned ring = 0; ring < steps; ++ring) add_ring(chosen);
    return;
  }
  if (steps == 2) {
    add_ring(chosen);
    add_ring(chosen);
  }
  std::vector<std::uint8_t> second = chosen;
  add_second_neighbors(second);
  add_ring(chosen);
  for (FaceId f = 0; f < active_count(); ++f) chosen[f] |= second[f];
}

Result<void> AdaptiveSubdivision::refine(std::span<const std::uint8_t> chosen) {
  if (chosen.size() != active_count()) {
    return fail(ErrorKind::usage, fmt::format("{} marks for {} active faces", chosen.size(), active_count()));
  }
  if (depth_ >= kMaxAdaptiveDepth) {
    return fail(ErrorKind::limit, fmt::format("{} half-steps are the most", kMaxAdaptiveDepth));
  }
  Step step(*this, chosen);
  const std::uint64_t corners = step.corners_afterwards();
  const std::uint64_t most = std::min(options_.max_corners, kMaxCorners);
  if (corners > most) {
    return fail(ErrorKind::limit, fmt::format("half-step {} would give {} corners, more than the limit of {}",
                                              depth_ + 1, corners, most));
  }
  step.run();
  return {};
}

AdaptiveMesh AdaptiveSubdivision::result() const& { return AdaptiveSubdivision(*this).take_result(); }

AdaptiveMesh AdaptiveSubdivision::result() && { return take_result(); }

AdaptiveMesh AdaptiveSubdivision::take_result() {
  AdaptiveMesh result;
  result.mesh.points = std::move(points_);
  result.mesh.corners = std::move(finished_corners_);
  result.mesh.face_begins = std::move(finished_begins_);
  result.face_depths = std::move(finished_depths_);
  result.face_origins = std::move(finished_origins_);
  result.mesh.corners.reserve(result.mesh.corners.size() + corners_.size());
  for (FaceId f = 0; f < active_count(); ++f) result.mesh.add_face(active_face(f));
  result.face_depths.resize(result.mesh.face_count(), static_cast<std::uint8_t>(depth_));
  result.face_origins.insert(result.face_origins.end(), origins_.begin(), origins_.end());
  return result;
}

}  // namespace fanstream
