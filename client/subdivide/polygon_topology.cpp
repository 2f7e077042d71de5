#include "client/subdivide/polygon_topology.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "client/subdivide/subdivision.h"

namespace fanstream {
namespace {

constexpr std::string_view kMend = "; clean_polygons() mends it";

Result<void> check_points(const PolygonMesh& mesh) {
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    const glm::dvec4& p = mesh.points[v];
    for (int i = 0; i < 4; ++i) {
      // The sum of some points of a mesh must not overflow.
      if (!(std::abs(p[i]) <= 1e100)) {
        return fail(ErrorKind::bad_input, fmt::format("vertex {}: {} is not finite, or beyond 1e100", v, p[i]));
      }
    }
    if (!(p.w > 0)) return fail(ErrorKind::bad_input, fmt::format("vertex {}: the weight {} is not above 0", v, p.w));
  }
  return {};
}

Result<void> check_faces(const PolygonMesh& mesh) {
  if (mesh.face_begins.empty() || mesh.face_begins.front() != 0 || mesh.face_begins.back() != mesh.corners.size()) {
    return fail(ErrorKind::bad_input, "the faces do not cover the corners");
  }
  std::vector<FaceId> last_face(mesh.points.size(), kNoFace);
  for (FaceId f = 0; f < mesh.face_count(); ++f) {
    if (mesh.face_begins[f + 1] > mesh.corners.size() || mesh.face_begins[f + 1] < mesh.face_begins[f] + 3) {
      return fail(ErrorKind::bad_input, fmt::format("face {} has fewer than three corners", f));
    }
    for (const VertexId v : mesh.face(f)) {
      if (v >= mesh.points.size()) {
        return fail(ErrorKind::bad_input, fmt::format("face {} names vertex {} of {}", f, v, mesh.points.size()));
      }
      if (last_face[v] == f) {
        return fail(ErrorKind::bad_input, fmt::format("face {} has vertex {} twice{}", f, v, kMend));
      }
      last_face[v] = f;
    }
  }
  return {};
}

// Finds half-edges by their ends.
class TwinSearch {
 public:
  explicit TwinSearch(const PolygonMesh& mesh) : mesh_(mesh), ends_(mesh.corners.size()) {
    faces_.resize(mesh.corners.size());
    begins_.assign(mesh.points.size() + 1, 0);
    for (const VertexId v : mesh.corners) ++begins_[v + 1];
    for (std::size_t v = 0; v < mesh.points.size(); ++v) begins_[v + 1] += begins_[v];
    std::vector<std::uint32_t> fill(begins_.begin(), begins_.end() - 1);
    outgoing_.resize(mesh.corners.size());
    for (FaceId f = 0; f < mesh.face_count(); ++f) {
      const std::uint32_t begin = mesh.face_begins[f];
      const std::uint32_t end = mesh.face_begins[f + 1];
      for (CornerId c = begin; c < end; ++c) {
        faces_[c] = f;
        ends_[c] = mesh.corners[next_corner(c, begin, end)];
        outgoing_[fill[mesh.corners[c]]++] = c;
      }
    }
    for (std::size_t v = 0; v < mesh.points.size(); ++v) {
      if (begins_[v + 1] - begins_[v] > kMostScanned) sort_outgoing(v);
    }
  }

  Result<std::vector<CornerId>> run() {
    if (auto once = check_once(); !once) return tl::unexpected(once.error());
    std::vector<CornerId> twins(mesh_.corners.size());
    for (CornerId c = 0; c < twins.size(); ++c) twins[c] = find(ends_[c], mesh_.corners[c]);
    if (auto fans = check_fans(twins); !fans) return tl::unexpected(fans.error());
    return twins;
  }

 private:
  static constexpr std::uint32_t kMostScanned = 16;
  using Iterator = std::vector<CornerId>::iterator;

  Iterator first(std::size_t v) { return outgoing_.begin() + begins_[v]; }
  Iterator last(std::size_t v) { return outgoing_.begin() + begins_[v + 1]; }
  void sort_outgoing(std::size_t v) {
    std::sort(first(v), last(v), [this](CornerId a, CornerId b) { return ends_[a] < ends_[b]; });
  }

  CornerId find(VertexId from, VertexId to) {
    if (begins_[from + 1] - begins_[from] > kMostScanned) {
      const Iterator found =
          std::lower_bound(first(from), last(from), to, [this](CornerId c, VertexId end) { return ends_[c] < end; });
      return found != last(from) && ends_[*found] == to ? *found : kBoundary;
    }
    for (std::uint32_t i = begins_[from]; i < begins_[from + 1]; ++i) {
      if (ends_[outgoing_[i]] == to) return outgoing_[i];
    }
    return kBoundary;
  }

  // No two half-edges may run between the same vertices in the same direction.
  Result<void> check_once() {
    for (std::size_t v = 0; v < mesh_.points.size(); ++v) {
      const std::uint32_t count = begins_[v + 1] - begins_[v];
      for (std::uint32_t i = 1; i < count; ++i) {
        const CornerId c = first(v)[i];
        for (std::uint32_t j = count > kMostScanned ? i - 1 : 0; j < i; ++j) {
          if (ends_[first(v)[j]] != ends_[c]) continue;
          return fail(ErrorKind::bad_input,
                      fmt::format("faces {} and {} both run from vertex {} to vertex {}: the edge has more than two "
                                  "faces, or the faces are wound differently{}",
                                  faces_[first(v)[j]], faces_[c], v, ends_[c], kMend));
        }
      }
    }
    return {};
  }

  Result<void> check_fans(const std::vector<CornerId>& twins) {
    for (std::size_t v = 0; v < mesh_.points.size(); ++v) {
      const std::uint32_t count = begins_[v + 1] - begins_[v];
      if (count < 2) continue;
      CornerId start = *first(v);
      for (std::uint32_t i = 0; i < count; ++i) {
        if (twins[first(v)[i]] == kBoundary) start = first(v)[i];
      }
      std::uint32_t reached = 0;
      CornerId at = start;
      do {
        ++reached;
        const FaceId f = faces_[at];
        at = twins[previous_corner(at, mesh_.face_begins[f], mesh_.face_begins[f + 1])];
      } while (at != kBoundary && at != start);
      if (reached == count) continue;
      return fail(ErrorKind::bad_input,
                  fmt::format("vertex {}: its {} faces form more than one fan: parts touch in a point there{}", v,
                              count, kMend));
    }
    return {};
  }

  const PolygonMesh& mesh_;
  std::vector<VertexId> ends_;  // where each half-edge ends
  std::vector<FaceId> faces_;
  std::vector<std::uint32_t> begins_;  // of each vertex, in outgoing_
  std::vector<CornerId> outgoing_;
};

}  // namespace

Result<std::vector<CornerId>> half_edge_twins(const PolygonMesh& mesh) {
  if (mesh.corners.size() > kMaxCorners || mesh.points.size() > 4 * kMaxCorners) {
    return fail(ErrorKind::limit, fmt::format("{} corners and {} vertices are more than can be subdivided ({} corners)",
                                              mesh.corners.size(), mesh.points.size(), kMaxCorners));
  }
  if (auto points = check_points(mesh); !points) return tl::unexpected(points.error());
  if (auto faces = check_faces(mesh); !faces) return tl::unexpected(faces.error());
  return TwinSearch(mesh).run();
}

Result<void> check_polygons(const PolygonMesh& mesh) {
  const Result<std::vector<CornerId>> twins = half_edge_twins(mesh);
  if (!twins) return tl::unexpected(twins.error());
  return {};
}

}  // namespace fanstream
