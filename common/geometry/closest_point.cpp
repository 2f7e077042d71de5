#include "common/geometry/closest_point.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>

namespace fanstream {

namespace {

struct Closest {
  glm::dvec3 point{0.0};
  double squared_distance = std::numeric_limits<double>::infinity();

  void offer(const glm::dvec3& query, const glm::dvec3& candidate) {
    const glm::dvec3 offset = query - candidate;
    const double squared = glm::dot(offset, offset);
    if (squared < squared_distance) {
      squared_distance = squared;
      point = candidate;
    }
  }
};

}  // namespace

glm::dvec3 closest_point_on_segment(const glm::dvec3& query, const glm::dvec3& a, const glm::dvec3& b) {
  const glm::dvec3 along = b - a;
  const double projected = glm::dot(query - a, along);
  if (!(projected > 0.0)) return a;
  const double squared_length = glm::dot(along, along);
  if (projected >= squared_length) return b;
  return a + along * (projected / squared_length);
}

glm::dvec3 closest_point_on_triangle(const glm::dvec3& query, const glm::dvec3& a, const glm::dvec3& b,
                                     const glm::dvec3& c) {
  const glm::dvec3 ab = b - a;
  const glm::dvec3 ac = c - a;
  const glm::dvec3 aq = query - a;
  const glm::dvec3 normal = glm::cross(ab, ac);
  const double area = glm::dot(normal, normal);
  const double longest = std::max(glm::dot(ab, ab), glm::dot(ac, ac));
  // Twice the triangle's area is longest edge times height; the longer of two edges is at least half of the longest.
  const bool degenerate = area <= 1e-20 * longest * longest;
  const double weight_b = glm::dot(glm::cross(aq, ac), normal);
  const double weight_c = glm::dot(glm::cross(ab, aq), normal);
  const double weight_a = area - weight_b - weight_c;
  if (!degenerate && weight_a >= 0.0 && weight_b >= 0.0 && weight_c >= 0.0) {
    return a + (ab * weight_b + ac * weight_c) / area;
  }
  // Outside: the closest point lies on an edge that the projection of the query is beyond.
  Closest closest;
  if (degenerate || weight_c < 0.0) closest.offer(query, closest_point_on_segment(query, a, b));
  if (degenerate || weight_b < 0.0) closest.offer(query, closest_point_on_segment(query, a, c));
  if (degenerate || weight_a < 0.0) closest.offer(query, closest_point_on_segment(query, b, c));
  return closest.point;
}

}  // namespace fanstream
