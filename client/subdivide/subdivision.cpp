#include "client/subdivide/subdivision.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

#include "client/subdivide/point4.h"
#include "client/subdivide/polygon_topology.h"
#include "common/support/huge_pages.h"

namespace fanstream {
namespace {

// What the counts of all levels follow from. A full step makes 4 quads' corners of every corner.
struct Counts {
  std::uint64_t corners = 0;
  std::uint64_t boundary_edges = 0;
  std::uint64_t edges() const { return (corners + boundary_edges) / 2; }
  std::uint64_t odd_corners() const { return 2 * corners + boundary_edges; }
};

constexpr std::uint64_t kManyCorners = std::uint64_t{1} << 60;

Counts counts_after(Counts counts, unsigned full_steps) {
  for (unsigned i = 0; i < full_steps && counts.corners > 0 && counts.corners < kManyCorners; ++i) {
    counts.corners *= 4;
    counts.boundary_edges *= 2;
  }
  return counts;
}

struct BoundaryEdge {
  VertexId from;
  VertexId to;
  std::uint32_t edge;  // as in Level::edges
};

// A mesh between two full steps. Half-edge h has edge edges[h] / 2, and the opposite one the same edge and another
// last bit.
struct Level {
  std::vector<glm::dvec4> points;
  std::vector<VertexId> corners;
  std::vector<std::uint32_t> edges;
  std::size_t edge_count = 0;
  std::vector<BoundaryEdge> boundary;
  std::vector<std::uint32_t> valences;   // of the first vertices; all further ones inside the surface have four faces
  std::vector<VertexId> fixed_vertices;  // by BoundaryRule::corners
};

class AnyFaces {
 public:
  explicit AnyFaces(const std::vector<std::uint32_t>& begins) : begins_(begins) {}
  std::size_t count() const { return begins_.size() - 1; }
  std::uint32_t begin(std::size_t f) const { return begins_[f]; }
  std::uint32_t end(std::size_t f) const { return begins_[f + 1]; }

 private:
  const std::vector<std::uint32_t>& begins_;
};

class QuadFaces {
 public:
  explicit QuadFaces(std::size_t count) : count_(count) {}
  std::size_t count() const { return count_; }
  static std::uint32_t begin(std::size_t f) { return static_cast<std::uint32_t>(4 * f); }
  static std::uint32_t end(std::size_t f) { return static_cast<std::uint32_t>(4 * f + 4); }

 private:
  std::size_t count_;
};

// The geometry of a full step, in one pass over the faces: each adds its point and its corners to its vertices and
// edges. Of vertices there comes the sum, over the faces around, of the face point and the next vertex.
template <class Faces>
void add_faces(const Level& level, const Faces& faces, std::vector<glm::dvec4>& points) {
  const std::size_t first_face = level.points.size();
  const std::size_t first_edge = first_face + faces.count();
  for (std::size_t f = 0; f < faces.count(); ++f) {
    const std::uint32_t begin = faces.begin(f);
    const std::uint32_t end = faces.end(f);
    Point4 center;
    for (std::uint32_t c = begin; c < end; ++c) center = center + load(level.points[level.corners[c]]);
    center = center * (1.0 / (end - begin));
    store(points[first_face + f], center);
    Point4 corner = load(level.points[level.corners[begin]]);
    const Point4 first = corner;
    for (std::uint32_t c = begin; c < end; ++c) {
      const Point4 next = c + 1 < end ? load(level.points[level.corners[c + 1]]) : first;
      add_to(points[level.corners[c]], center + next);
      add_to(points[first_edge + level.edges[c] / 2], (corner + center) * 0.25);
      corner = next;
    }
  }
}

// The points of the next level, in the order vertices, faces, edges.
template <class Faces>
std::vector<glm::dvec4> refined_points(const Level& level, const Faces& faces) {
  const std::size_t first_edge = level.points.size() + faces.count();
  std::vector<glm::dvec4> points;
  resize_large(points, first_edge + level.edge_count);
  add_faces(level, faces, points);
  // (Q + 2 R + (n - 3) S) / n with all means written as sums; a weight of 1 stays 1 exactly.
  const auto settle = [&](VertexId v, double valence) {
    const Point4 old = load(level.points[v]);
    const Point4 sum = load(points[v]);
    store(points[v], old + (sum - old * (2.0 * valence)) * (1.0 / (valence * valence)));
  };
  for (VertexId v = 0; v < level.valences.size(); ++v) {
    if (level.valences[v] > 0) {
      settle(v, level.valences[v]);
    } else {
      points[v] = level.points[v];
    }
  }
  for (std::size_t v = level.valences.size(); v < level.points.size(); ++v) settle(static_cast<VertexId>(v), 4.0);

  for (const BoundaryEdge& edge : level.boundary) points[edge.from] = glm::dvec4(0);
  for (const BoundaryEdge& edge : level.boundary) {
    const Point4 from = load(level.points[edge.from]);
    const Point4 to = load(level.points[edge.to]);
    add_to(points[edge.from], (from * 3.0 + to) * 0.125);
    add_to(points[edge.to], (to * 3.0 + from) * 0.125);
    store(points[first_edge + edge.edge / 2], (from + to) * 0.5);
  }
  for (const VertexId v : level.fixed_vertices) points[v] = level.points[v];
  return points;
}

// The half of an edge near vertex v takes the number of the half-edge that starts at v.
template <class Faces, bool with_edges>
void refine_corners(const Level& level, const Faces& faces, Level& next) {
  const auto first_face = static_cast<VertexId>(level.points.size());
  const auto first_edge = static_cast<VertexId>(first_face + faces.count());
  const auto first_inner_edge = static_cast<std::uint32_t>(2 * level.edge_count);
  for (std::size_t f = 0; f < faces.count(); ++f) {
    const std::uint32_t begin = faces.begin(f);
    const std::uint32_t end = faces.end(f);
    std::uint32_t before = end - 1;
    for (std::uint32_t c = begin; c < end; before = c++) {
      VertexId* corners = &next.corners[std::size_t{4} * c];
      corners[0] = level.corners[c];
      corners[1] = first_edge + level.edges[c] / 2;
      corners[2] = first_face + static_cast<VertexId>(f);
      corners[3] = first_edge + level.edges[before] / 2;
      if constexpr (with_edges) {
        std::uint32_t* edges = &next.edges[std::size_t{4} * c];
        edges[0] = 2 * level.edges[c];
        edges[1] = 2 * (first_inner_edge + c);
        edges[2] = 2 * (first_inner_edge + before) + 1;
        edges[3] = 2 * (level.edges[before] ^ 1U) + 1;
      }
    }
  }
}

template <class Faces>
Level refined(const Level& level, const Faces& faces, bool last) {
  Level next;
  next.points = refined_points(level, faces);
  resize_large(next.corners, 4 * level.corners.size());
  if (last) {
    refine_corners<Faces, false>(level, faces, next);
    return next;
  }
  resize_large(next.edges, 4 * level.corners.size());
  refine_corners<Faces, true>(level, faces, next);
  next.edge_count = 2 * level.edge_count + level.corners.size();
  const std::size_t first_edge = level.points.size() + faces.count();
  next.boundary.reserve(2 * level.boundary.size());
  for (const BoundaryEdge& edge : level.boundary) {
    const auto middle = static_cast<VertexId>(first_edge + edge.edge / 2);
    next.boundary.push_back({edge.from, middle, 2 * edge.edge});
    next.boundary.push_back({middle, edge.to, 2 * (edge.edge ^ 1U) + 1});
  }
  next.fixed_vertices = level.fixed_vertices;
  return next;
}

std::vector<std::uint32_t> equal_begins(std::size_t faces, std::uint32_t size) {
  std::vector<std::uint32_t> begins;
  resize_large(begins, faces + 1);
  for (std::size_t f = 0; f <= faces; ++f) begins[f] = static_cast<std::uint32_t>(f * size);
  return begins;
}

// The last half-step of an odd depth: face e lies along edge e.
template <class Faces>
PolygonMesh half_refined(const Level& level, const Faces& faces) {
  PolygonMesh mesh;
  mesh.points = refined_points(level, faces);
  const std::size_t first_face = level.points.size();
  mesh.points.resize(first_face + faces.count());
  std::vector<std::array<VertexId, 4>> quads;
  resize_large(quads, level.edge_count);
  for (std::size_t f = 0; f < faces.count(); ++f) {
    for (std::uint32_t c = faces.begin(f); c < faces.end(f); ++c) {
      std::array<VertexId, 4>& quad = quads[level.edges[c] / 2];
      const bool second = level.edges[c] % 2 == 1;
      quad[second ? 2 : 0] = level.corners[c];
      quad[second ? 1 : 3] = static_cast<VertexId>(first_face + f);
    }
  }
  std::vector<std::uint8_t> at_boundary(level.edge_count, 0);
  for (const BoundaryEdge& edge : level.boundary) {
    at_boundary[edge.edge / 2] = 1;
    std::array<VertexId, 4>& quad = quads[edge.edge / 2];
    quad = {edge.from, edge.to, quad[edge.edge % 2 == 1 ? 1 : 3], 0};
  }
  mesh.corners.reserve(4 * level.edge_count - level.boundary.size());
  mesh.face_begins.reserve(level.edge_count + 1);
  for (std::size_t e = 0; e < level.edge_count; ++e) {
    mesh.add_face(std::span<const VertexId>(quads[e]).first(at_boundary[e] != 0 ? 3 : 4));
  }
  return mesh;
}

Level first_level(const PolygonMesh& mesh, const std::vector<CornerId>& twins, BoundaryRule rule) {
  Level level;
  level.points = mesh.points;
  level.corners = mesh.corners;
  level.edges.resize(mesh.corners.size());
  level.valences.assign(mesh.points.size(), 0);
  for (FaceId f = 0; f < mesh.face_count(); ++f) {
    const std::uint32_t begin = mesh.face_begins[f];
    const std::uint32_t end = mesh.face_begins[f + 1];
    for (CornerId c = begin; c < end; ++c) {
      ++level.valences[mesh.corners[c]];
      if (twins[c] != kBoundary && twins[c] < c) {
        level.edges[c] = level.edges[twins[c]] + 1;
        continue;
      }
      level.edges[c] = static_cast<std::uint32_t>(2 * level.edge_count++);
      if (twins[c] == kBoundary) {
        level.boundary.push_back({mesh.corners[c], mesh.corners[next_corner(c, begin, end)], level.edges[c]});
      }
    }
  }
  for (VertexId v = 0; v < level.valences.size(); ++v) {
    if (rule == BoundaryRule::corners && level.valences[v] == 1) level.fixed_vertices.push_back(v);
  }
  return level;
}

Counts counts_of(const std::vector<CornerId>& twins) {
  return {twins.size(), static_cast<std::uint64_t>(std::count(twins.begin(), twins.end(), kBoundary))};
}

Result<void> check_limit(const Counts& counts, unsigned depth, const SubdivisionOptions& options) {
  const Counts last = counts_after(counts, depth / 2);
  const std::uint64_t corners = depth % 2 == 0 ? last.corners : last.odd_corners();
  const std::uint64_t most = std::min(options.max_corners, kMaxCorners);
  if (corners <= most) return {};
  unsigned possible = depth;
  while (possible > 0) {
    const Counts less = counts_after(counts, --possible / 2);
    if ((possible % 2 == 0 ? less.corners : less.odd_corners()) <= most) break;
  }
  return fail(ErrorKind::limit,
              fmt::format("depth {} would give {} corners, more than the limit of {}; depth {} is the "
                          "greatest within it",
                          depth, corners, most, possible));
}

}  // namespace

std::size_t uniform_face_count(const PolygonMesh& mesh, unsigned depth) {
  if (depth == 0) return mesh.face_count();
  const Result<std::vector<CornerId>> twins = half_edge_twins(mesh);
  if (!twins) return 0;
  const Counts counts = counts_of(*twins);
  return depth % 2 == 0 ? counts_after(counts, depth / 2 - 1).corners : counts_after(counts, depth / 2).edges();
}

Result<PolygonMesh> subdivide(const PolygonMesh& mesh, unsigned depth, const SubdivisionOptions& options) {
  const Result<std::vector<CornerId>> twins = half_edge_twins(mesh);
  if (!twins) return tl::unexpected(twins.error());
  if (depth == 0 || mesh.corners.empty()) return mesh;
  if (auto fits = check_limit(counts_of(*twins), std::min(depth, 200U), options); !fits) {
    return tl::unexpected(fits.error());
  }
  Level level = first_level(mesh, *twins, options.boundary);
  if (depth == 1) return half_refined(level, AnyFaces(mesh.face_begins));
  std::vector<std::uint32_t> valences = level.valences;
  for (FaceId f = 0; f < mesh.face_count(); ++f) valences.push_back(mesh.face_begins[f + 1] - mesh.face_begins[f]);
  level = refined(level, AnyFaces(mesh.face_begins), depth == 2);
  level.valences = valences;
  for (unsigned done = 2; done + 1 < depth; done += 2) {
    level = refined(level, QuadFaces(level.corners.size() / 4), done + 2 == depth);
    level.valences = valences;
  }
  if (depth % 2 == 1) return half_refined(level, QuadFaces(level.corners.size() / 4));
  PolygonMesh result;
  result.face_begins = equal_begins(level.corners.size() / 4, 4);
  result.points = std::move(level.points);
  result.corners = std::move(level.corners);
  return result;
}

}  // namespace fanstream
