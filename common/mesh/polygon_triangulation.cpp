#include "common/mesh/polygon_triangulation.h"

#include <cmath>
#include <glm/vec2.hpp>

namespace fanstream {
namespace {

constexpr std::size_t kMaxClippedCorners = 256;
// Ear clipping needs about two tests per corner; polygons that need far more are not simple.
constexpr std::size_t kMaxEarTestsPerCorner = 8;

double cross(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

// The corners projected along the greatest axis of the polygon's normal, counter-clockwise.
std::vector<glm::dvec2> project(const std::vector<glm::dvec3>& positions, std::span<const VertexId> polygon) {
  const glm::dvec3 origin = positions[polygon[0]];
  glm::dvec3 normal(0);
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const glm::dvec3 a = positions[polygon[i]] - origin;
    const glm::dvec3 b = positions[polygon[(i + 1) % polygon.size()]] - origin;
    normal += glm::dvec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
  }
  int axis = std::abs(normal.x) > std::abs(normal.y) ? 0 : 1;
  if (std::abs(normal.z) > std::abs(normal[axis])) axis = 2;
  int u = (axis + 1) % 3;
  int v = (axis + 2) % 3;
  if (normal[axis] < 0) std::swap(u, v);
  std::vector<glm::dvec2> corners;
  corners.reserve(polygon.size());
  for (const VertexId vertex : polygon) {
    const glm::dvec3 p = positions[vertex] - origin;
    corners.emplace_back(p[u], p[v]);
  }
  return corners;
}

bool is_convex(const std::vector<glm::dvec2>& corners) {
  const std::size_t n = corners.size();
  for (std::size_t i = 0; i < n; ++i) {
    if (cross(corners[i], corners[(i + 1) % n], corners[(i + 2) % n]) < 0) return false;
  }
  return true;
}

bool is_ear(const std::vector<glm::dvec2>& corners, const std::vector<std::uint32_t>& left, std::size_t at) {
  const std::size_t n = left.size();
  const glm::dvec2 a = corners[left[(at + n - 1) % n]];
  const glm::dvec2 b = corners[left[at]];
  const glm::dvec2 c = corners[left[(at + 1) % n]];
  if (!(cross(a, b, c) > 0)) return false;
  for (std::size_t i = 2; i + 1 < n; ++i) {
    const glm::dvec2 p = corners[left[(at + i) % n]];
    if (p == a || p == b || p == c) continue;
    if (cross(a, b, p) >= 0 && cross(b, c, p) >= 0 && cross(c, a, p) >= 0) return false;
  }
  return true;
}

}  // namespace

void triangulate_polygon(const std::vector<glm::dvec3>& positions, std::span<const VertexId> polygon,
                         std::vector<Triangle>& triangles) {
  const std::size_t n = polygon.size();
  const auto add_fan = [&](const auto& corner, std::size_t count) {
    for (std::size_t i = 1; i + 1 < count; ++i) triangles.push_back({corner(0), corner(i), corner(i + 1)});
  };
  const auto whole = [&](std::size_t i) { return polygon[i]; };
  if (n <= 3 || n > kMaxClippedCorners) return add_fan(whole, n);
  const std::vector<glm::dvec2> corners = project(positions, polygon);
  if (is_convex(corners)) return add_fan(whole, n);
  std::vector<std::uint32_t> left(n);
  for (std::size_t i = 0; i < n; ++i) left[i] = static_cast<std::uint32_t>(i);
  std::size_t at = 0;
  for (std::size_t tests = 0; left.size() > 3 && tests < kMaxEarTestsPerCorner * n; ++tests) {
    const std::size_t count = left.size();
    at %= count;
    if (is_ear(corners, left, at)) {
      triangles.push_back(
          {polygon[left[(at + count - 1) % count]], polygon[left[at]], polygon[left[(at + 1) % count]]});
      left.erase(left.begin() + static_cast<std::ptrdiff_t>(at));
    } else {
      ++at;
    }
  }
  add_fan([&](std::size_t i) { return polygon[left[i]]; }, left.size());
}

}  // namespace fanstream
