#include "common/fans/vertex_stars.h"

#include <fmt/format.h>

namespace fanstream {

Result<VertexStars> VertexStars::build(std::size_t vertex_count, std::span<const Triangle> triangles) {
  if (triangles.size() >= kNone / 3 || vertex_count >= kNone) {
    return fail(ErrorKind::limit, fmt::format("{} vertices and {} faces: at most {} of each can be covered by fans",
                                              vertex_count, triangles.size(), kNone / 3));
  }
  VertexStars stars;
  stars.triangles_ = triangles;
  if (auto counted = stars.count_corners(vertex_count); !counted) return tl::unexpected(counted.error());
  stars.across_.assign(3 * triangles.size(), kNone);
  stars.closed_.assign(vertex_count, 0);
  std::vector<CornerId> corner_leaving(vertex_count, kNone);
  std::vector<CornerId> ordered;
  for (VertexId vertex = 0; vertex < vertex_count; ++vertex) {
    if (auto done = stars.order_star(vertex, corner_leaving, ordered); !done) return tl::unexpected(done.error());
  }
  return stars;
}

Result<void> VertexStars::count_corners(std::size_t vertex_count) {
  first_.assign(vertex_count + 1, 0);
  for (std::size_t face = 0; face < triangles_.size(); ++face) {
    const Triangle& triangle = triangles_[face];
    for (const VertexId vertex : triangle) {
      if (vertex >= vertex_count) {
        return fail(ErrorKind::bad_input, fmt::format("face {} names vertex {} of {}", face, vertex, vertex_count));
      }
      ++first_[vertex + 1];
    }
    if (triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0]) {
      return fail(ErrorKind::bad_input, fmt::format("face {} uses a vertex twice", face));
    }
  }
  for (std::size_t vertex = 0; vertex < vertex_count; ++vertex) first_[vertex + 1] += first_[vertex];
  corners_.resize(3 * triangles_.size());
  std::vector<std::uint32_t> fill(first_.begin(), first_.end() - 1);
  for (std::size_t face = 0; face < triangles_.size(); ++face) {
    for (std::size_t k = 0; k < 3; ++k) {
      corners_[fill[triangles_[face][k]]++] = static_cast<CornerId>(3 * face + k);
    }
  }
  return {};
}

// Face (v, a, b) leaves v along a and comes back along b: the next face of the star is the one that leaves along b.
Result<void> VertexStars::order_star(VertexId vertex, std::vector<CornerId>& corner_leaving,
                                     std::vector<CornerId>& ordered) {
  const std::span<CornerId> corners(corners_.data() + first_[vertex], first_[vertex + 1] - first_[vertex]);
  if (corners.empty()) return {};
  bool repeated = false;
  for (const CornerId corner : corners) {
    CornerId& slot = corner_leaving[this->vertex(next_corner(corner))];
    repeated = repeated || slot != kNone;
    slot = corner;
  }
  std::size_t ends = 0;
  for (const CornerId corner : corners) {
    const CornerId next = corner_leaving[this->vertex(previous_corner(corner))];
    if (next == kNone) {
      ++ends;
      continue;
    }
    across_[next_corner(corner)] = face_of(next);
    across_[previous_corner(next)] = face_of(corner);
  }
  CornerId start = corners[0];
  if (ends > 0) {  // the start is the face that no other leads to
    for (const CornerId corner : corners) {
      if (across_[previous_corner(corner)] == kNone) start = corner;
    }
  }
  ordered.clear();
  for (CornerId corner = start; corner != kNone && ordered.size() <= corners.size();) {
    ordered.push_back(corner);
    corner = corner_leaving[this->vertex(previous_corner(corner))];
    if (corner == start) break;
  }
  for (const CornerId corner : corners) corner_leaving[this->vertex(next_corner(corner))] = kNone;
  if (repeated || ends > 1 || ordered.size() != corners.size()) {
    return fail(ErrorKind::bad_input,
                fmt::format("the faces around vertex {} are not one fan: clean the mesh first", vertex));
  }
  closed_[vertex] = ends == 0 ? 1 : 0;
  for (std::size_t i = 0; i < ordered.size(); ++i) corners[i] = ordered[i];
  return {};
}

}  // namespace fanstream
