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
  Point4 center(FaceId f) const;

  void add_centers();
  void move_vertices();
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

Point4 AdaptiveSubdivision::Step::center(FaceId f) const {
  Point4 sum;
  for (CornerId c = s_.begins_[f]; c < s_.begins_[f + 1]; ++c) sum = sum + old_point(s_.corners_[c]);
  return sum * (1.0 / (s_.begins_[f + 1] - s_.begins_[f]));
}

void AdaptiveSubdivision::Step::add_centers() {
  centers_.assign(refined_.size(), 0);
  for (FaceId f = 0; f < refined_.size(); ++f) {
    if (refined_[f] == 0) continue;
    centers_[f] = static_cast<VertexId>(s_.points_.size());
    s_.points_.emplace_back();
    if (odd_) {
      store(s_.points_.back(), center(f));
    } else {
      s_.points_.back() = s_.edge_points_[f];
    }
  }
}

// The vertices of refined faces, all of whose faces are active.
void AdaptiveSubdivision::Step::move_vertices() {
  struct Moved {
    VertexId vertex;
    Point4 sum;       // of face points and next vertices
    Point4 boundary;  // of neighbours along the boundary
    std::uint32_t faces = 0;
    bool at_boundary = false;
  };
  std::vector<Moved> moved;
  std::vector<std::uint32_t> slot(s_.points_.size(), ~0U);
  for (FaceId f = 0; f < refined_.size(); ++f) {
    if (refined_[f] == 0) continue;
    for (const VertexId v : s_.active_face(f)) {
      if (slot[v] != ~0U) continue;
      slot[v] = static_cast<std::uint32_t>(moved.size());
      moved.push_back({v, {}, {}});
    }
  }
  for (FaceId f = 0; f < refined_.size(); ++f) {
    const std::span<const VertexId> face = s_.active_face(f);
    if (std::all_of(face.begin(), face.end(), [&](VertexId v) { return slot[v] == ~0U; })) continue;
    const Point4 middle = refined_[f] != 0 ? old_point(centers_[f]) : center(f);
    for (CornerId c = s_.begins_[f]; c < s_.begins_[f + 1]; ++c) {
      const VertexId from = s_.corners_[c];
      const VertexId to = s_.corners_[next(c)];
      const bool boundary = s_.twins_[c] == kBoundary;
      if (slot[from] != ~0U) {
        Moved& move = moved[slot[from]];
        move.sum = move.sum + middle + old_point(to);
        ++move.faces;
        if (boundary) move.boundary = move.boundary + old_point(to);
        move.at_boundary |= boundary;
      }
      if (boundary && slot[to] != ~0U) {
        moved[slot[to]].boundary = moved[slot[to]].boundary + old_point(from);
        moved[slot[to]].at_boundary = true;
      }
    }
  }
  for (Moved& move : moved) {
    const Point4 old = old_point(move.vertex);
    const double n = move.faces;
    if (!move.at_boundary) {
      move.sum = old + (move.sum - old * (2.0 * n)) * (1.0 / (n * n));
    } else if (n == 1 && s_.options_.boundary == BoundaryRule::corners) {
      move.sum = old;
    } else {
      move.sum = (old * 6.0 + move.boundary) * 0.125;
    }
  }
  for (const Moved& move : moved) store(s_.points_[move.vertex], move.sum);
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
  add_centers();
  add_faces();  // reads the vertices as they were
  if (odd_) move_vertices();
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

void AdaptiveSubdivision::add_support(std::vector<std::uint8_t>& chosen) const {
  std::vector<std::uint8_t> near(points_.size(), 0);
  std::vector<FaceId> further;
  for (FaceId f = 0; f < active_count(); ++f) {
    if (chosen[f] == 0) continue;
    for (const VertexId v : active_face(f)) near[v] = 1;
    if (next_is_odd()) continue;
    for (std::size_t k = 0; k < active_face(f).size(); ++k) {
      const FaceId g = active_neighbor(f, k);
      if (g == kNoFace) continue;
      for (std::size_t i = 0; i < active_face(g).size(); ++i) {
        if (active_neighbor(g, i) != kNoFace) further.push_back(active_neighbor(g, i));
      }
    }
  }
  for (FaceId f = 0; f < active_count(); ++f) {
    for (const VertexId v : active_face(f)) chosen[f] |= near[v];
  }
  for (const FaceId f : further) chosen[f] = 1;
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
