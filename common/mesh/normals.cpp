#include "common/mesh/normals.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

namespace fanstream {
namespace {

// Unit length, or zero for a triangle without area.
glm::dvec3 face_normal(std::span<const glm::dvec3> positions, const Triangle& triangle) {
  const glm::dvec3 a = positions[triangle[0]];
  const glm::dvec3 normal = glm::cross(positions[triangle[1]] - a, positions[triangle[2]] - a);
  const double length = glm::length(normal);
  return length > 0.0 && std::isfinite(length) ? normal / length : glm::dvec3(0.0);
}

double angle_at(const glm::dvec3& apex, const glm::dvec3& a, const glm::dvec3& b) {
  const double length = glm::length(a - apex) * glm::length(b - apex);
  if (!(length > 0.0)) return 0.0;
  return std::acos(std::clamp(glm::dot(a - apex, b - apex) / length, -1.0, 1.0));
}

}  // namespace

std::vector<glm::vec3> vertex_normals(std::span<const glm::dvec3> positions, std::span<const Triangle> triangles,
                                      const NormalOptions& options) {
  std::vector<glm::dvec3> sums(positions.size(), glm::dvec3(0.0));
  for (const Triangle& t : triangles) {
    const glm::dvec3 normal = face_normal(positions, t);
    for (std::size_t k = 0; k < 3; ++k) {
      sums[t[k]] += normal * angle_at(positions[t[k]], positions[t[(k + 1) % 3]], positions[t[(k + 2) % 3]]);
    }
  }
  for (glm::dvec3& sum : sums) {
    const double length = glm::length(sum);
    sum = length > 1e-6 ? sum / length : glm::dvec3(0.0);
  }
  std::vector<glm::vec3> normals(sums.begin(), sums.end());
  const double smallest_cosine = std::cos(glm::radians(std::clamp(options.crease_angle_deg, 0.0, 180.0)));
  for (const Triangle& t : triangles) {
    const glm::dvec3 normal = face_normal(positions, t);
    if (normal == glm::dvec3(0.0)) continue;
    for (const VertexId vertex : t) {
      if (glm::dot(normal, sums[vertex]) < smallest_cosine - 1e-12) normals[vertex] = glm::vec3(0.0F);
    }
  }
  return normals;
}

}  // namespace fanstream
