#include "client/smooth/smooth_silhouette.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <numeric>
#include <tuple>

namespace fanstream {
namespace {

// Newell's, of any length.
glm::dvec3 normal_of(std::span<const VertexId> face, const std::vector<glm::dvec3>& positions) {
  glm::dvec3 normal(0.0);
  const glm::dvec3& origin = positions[face[0]];
  for (std::size_t i = 1; i + 1 < face.size(); ++i) {
    normal += glm::cross(positions[face[i]] - origin, positions[face[i + 1]] - origin);
  }
  return normal;
}

constexpr std::uint32_t kNone = ~std::uint32_t{0};

struct Edge {
  VertexId from = 0, to = 0;  // as the first face has it
  std::uint32_t face = 0;
  std::uint32_t other = kNone;  // none on a boundary
};

std::vector<Edge> edges_of(const JoinedFaces& faces) {
  std::vector<Edge> sides;
  sides.reserve(faces.corners.size());
  for (std::uint32_t f = 0; f < faces.face_count(); ++f) {
    const std::span<const VertexId> face = faces.face(f);
    for (std::size_t i = 0; i < face.size(); ++i) sides.push_back({face[i], face[(i + 1) % face.size()], f, kNone});
  }
  const auto key = [](const Edge& e) { return std::pair(std::min(e.from, e.to), std::max(e.from, e.to)); };
  std::sort(sides.begin(), sides.end(),
            [&](const Edge& a, const Edge& b) { return key(a) != key(b) ? key(a) < key(b) : a.face < b.face; });
  std::vector<Edge> edges;
  for (const Edge& side : sides) {
    if (!edges.empty() && key(edges.back()) == key(side)) {
      edges.back().other = side.face;
    } else {
      edges.push_back(side);
    }
  }
  return edges;
}

// Vertices that stay where they are, and with them the faces around them.
class FixedVertices {
 public:
  FixedVertices(const LiveFaces& live, const std::vector<Edge>& edges, double crease_angle_deg)
      : live_(live), cosine_(std::cos(glm::radians(crease_angle_deg))), fixed_(live.positions.size(), 0) {
    fix_shared_places();
    if (crease_angle_deg < 180.0) fix_creases(edges);
    for (std::uint32_t f = 0; f < live.faces.face_count(); ++f) {
      if (live.finest[f] != 0) continue;
      for (const VertexId v : live.faces.face(f)) fixed_[v] = 1;
    }
  }
  bool contains(VertexId v) const { return fixed_[v] != 0; }

 private:
  // Where a mesh was cut apart to be a manifold, both sides have to stay together.
  void fix_shared_places() {
    std::vector<VertexId> order(live_.positions.size());
    std::iota(order.begin(), order.end(), 0U);
    const auto key = [this](VertexId v) {
      const glm::dvec3& p = live_.positions[v];
      return std::tie(p.x, p.y, p.z);
    };
    std::sort(order.begin(), order.end(), [&](VertexId a, VertexId b) { return key(a) < key(b); });
    for (std::size_t i = 1; i < order.size(); ++i) {
      if (key(order[i]) == key(order[i - 1])) fixed_[order[i]] = fixed_[order[i - 1]] = 1;
    }
  }

  // Whether b turns away from a by more than the crease angle. Nothing is said of vectors without length.
  bool turns(const glm::dvec3& a, const glm::dvec3& b) const {
    const double lengths = glm::length(a) * glm::length(b);
    return lengths > 0.0 && glm::dot(a, b) < cosine_ * lengths;
  }

  void fix_creases(const std::vector<Edge>& edges) {
    std::vector<glm::dvec3> normals;
    for (std::uint32_t f = 0; f < live_.faces.face_count(); ++f) {
      normals.push_back(normal_of(live_.faces.face(f), live_.positions));
    }
    std::vector<VertexId> before(live_.positions.size(), kNone);  // of boundary vertices
    std::vector<VertexId> after(live_.positions.size(), kNone);
    for (const Edge& edge : edges) {
      if (edge.other == kNone) {
        after[edge.from] = edge.to;
        before[edge.to] = edge.from;
      } else if (turns(normals[edge.face], normals[edge.other])) {
        fixed_[edge.from] = fixed_[edge.to] = 1;
      }
    }
    for (VertexId v = 0; v < fixed_.size(); ++v) {
      if (before[v] == kNone || after[v] == kNone) continue;
      const glm::dvec3& here = live_.positions[v];
      if (turns(here - live_.positions[before[v]], live_.positions[after[v]] - here)) fixed_[v] = 1;
    }
  }

  const LiveFaces& live_;
  double cosine_;
  std::vector<std::uint8_t> fixed_;  // by vertex
};

// Faces that share several edges with one neighbour. Quads made of them would be cut along the same diagonal twice.
void exclude_double_neighbours(const std::vector<Edge>& edges, std::vector<std::uint8_t>& eligible) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (const Edge& edge : edges) {
    if (edge.other != kNone) pairs.emplace_back(std::min(edge.face, edge.other), std::max(edge.face, edge.other));
  }
  std::sort(pairs.begin(), pairs.end());
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    if (pairs[i] == pairs[i - 1]) eligible[pairs[i].first] = eligible[pairs[i].second] = 0;
  }
}

PolygonMesh polygons_of(const LiveFaces& live) {
  PolygonMesh mesh;
  mesh.points.reserve(live.positions.size());
  for (const glm::dvec3& p : live.positions) mesh.points.emplace_back(p, 1.0);
  mesh.corners = live.faces.corners;
  mesh.face_begins = live.faces.first;
  return mesh;
}

// Faces that were not cut keep the triangles that they had.
TriangleMesh triangles_of(const LiveFaces& live, const AdaptiveMesh& refined) {
  PolygonMesh cut;
  std::vector<std::uint8_t> whole(live.faces.face_count(), 0);
  for (FaceId f = 0; f < refined.mesh.face_count(); ++f) {
    if (refined.face_depths[f] == 0) {
      whole[refined.face_origins[f]] = 1;
    } else {
      cut.add_face(refined.mesh.face(f));
    }
  }
  cut.points = refined.mesh.points;
  TriangleMesh mesh = triangle_mesh(cut);
  for (std::size_t t = 0; t < live.triangles.size(); ++t) {
    if (whole[live.faces.face_of_triangle[t]] != 0) mesh.triangles.push_back(live.triangles[t]);
  }
  return mesh;
}

TriangleMesh unchanged(const LiveFaces& live) { return {live.positions, live.triangles}; }

// The subdivision within the limit, at lower depths where it takes that; nothing if not even the lowest fits.
Result<std::optional<AdaptiveMesh>> refine_within_limit(const LiveFaces& live, const View& view,
                                                        const SmoothOptions& options,
                                                        std::span<const std::uint8_t> eligible, SmoothReport& report) {
  const PolygonMesh polygons = polygons_of(live);
  ViewSubdivisionOptions subdivision;
  subdivision.front_depth = options.front_depth;
  subdivision.silhouette_depth = options.silhouette_depth;
  subdivision.size_px = options.size_px;
  subdivision.tolerance_px = options.tolerance_px;
  // A face of n corners gives n - 2 triangles, so quads have two corners for each.
  subdivision.subdivision.max_corners =
      static_cast<std::size_t>(std::min<std::uint64_t>(kMaxCorners, 2 * options.max_triangles));
  if (options.stop) subdivision.stop = [&options](unsigned) { return options.stop(); };
  while (true) {
    Result<ViewSubdivision> done = subdivide_for_view(polygons, view, subdivision, eligible);
    if (done) {
      report.front_depth = subdivision.front_depth;
      report.silhouette_depth = subdivision.silhouette_depth;
      return std::optional(std::move(done->refined));
    }
    if (done.error().kind != ErrorKind::limit) return tl::unexpected(done.error());
    report.limitation = fmt::format("more than {} triangles would be made", options.max_triangles);
    unsigned& deeper =
        subdivision.silhouette_depth > subdivision.front_depth ? subdivision.silhouette_depth : subdivision.front_depth;
    if (deeper <= 1) return std::optional<AdaptiveMesh>();
    deeper = deeper > 2 ? deeper - 2 : 0;
  }
}

}  // namespace

std::vector<std::uint8_t> eligible_faces(const LiveFaces& live, double crease_angle_deg) {
  const std::vector<Edge> edges = edges_of(live.faces);
  const FixedVertices fixed(live, edges, crease_angle_deg);
  std::vector<std::uint8_t> eligible(live.faces.face_count(), 0);
  for (std::uint32_t f = 0; f < eligible.size(); ++f) {
    const std::span<const VertexId> face = live.faces.face(f);
    eligible[f] = std::none_of(face.begin(), face.end(), [&](VertexId v) { return fixed.contains(v); }) ? 1 : 0;
  }
  exclude_double_neighbours(edges, eligible);
  return eligible;
}

Result<SmoothedMesh> smooth_for_view(const LiveFaces& live, const View& view, const SmoothOptions& options) {
  const auto begun = std::chrono::steady_clock::now();
  SmoothedMesh smoothed;
  SmoothReport& report = smoothed.report;
  const std::vector<std::uint8_t> eligible = eligible_faces(live, options.crease_angle_deg);
  report.faces_before = report.faces_after = live.faces.face_count();
  report.finest_faces = static_cast<std::uint64_t>(std::count(live.finest.begin(), live.finest.end(), 1));
  report.eligible_faces = static_cast<std::uint64_t>(std::count(eligible.begin(), eligible.end(), 1));
  Result<std::optional<AdaptiveMesh>> refined = refine_within_limit(live, view, options, eligible, report);
  if (!refined) return tl::unexpected(refined.error());
  if (*refined) {
    report.faces_after = (*refined)->mesh.face_count();
    for (const std::uint8_t depth : (*refined)->face_depths) report.depth = std::max<unsigned>(report.depth, depth);
  }
  smoothed.mesh = report.depth == 0 ? unchanged(live) : triangles_of(live, **refined);
  report.triangles_after = smoothed.mesh.triangles.size();
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  return smoothed;
}

void SilhouetteSmoother::update_polygons(const ProgressiveMesh& mesh) {
  const std::span<const std::byte> bytes = mesh.polygon_bytes();
  if (unreadable_ || bytes.empty()) return;
  if (!polygons_) {
    Result<SourcePolygons> read = SourcePolygons::read(bytes, mesh.head(), mesh.index(), "the asset");
    if (!read) {
      unreadable_ = true;
      damage_ = read.error().message;
      return;
    }
    polygons_ = std::move(*read);
  }
  if (const Result<void> decoded = polygons_->update(mesh); !decoded) damage_ = decoded.error().message;
}

Result<SmoothedMesh> SilhouetteSmoother::smooth(const ProgressiveMesh& mesh, const View& view) {
  update_polygons(mesh);
  const bool missing = mesh.head().polygon_bytes != 0 && !polygons_;
  LiveFaces live = live_faces(mesh, polygons_ ? &*polygons_ : nullptr);
  if (missing) live.finest.assign(live.finest.size(), 0);
  Result<SmoothedMesh> smoothed = smooth_for_view(live, view, options_);
  if (!smoothed) return smoothed;
  if (!damage_.empty()) smoothed->report.limitation = damage_;
  if (missing && damage_.empty()) smoothed->report.limitation = "the model's polygons have not been received";
  return smoothed;
}

}  // namespace fanstream
