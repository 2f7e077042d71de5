#include "common/geometry/closest_point.h"

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
  const double weight_b = glm::dot(glm::cross(aq, ac), normal);
  const double weight_c = glm::dot(glm::cross(ab, aq), normal);
  const double weight_a = area - weight_b - weight_c;
  // Every candidate is a point of the triangle. The edges are asked even where the weights say "inside", because the
  // weights of a needle whose corners are on a line but for rounding say anything.
  Closest closest;
  if (area > 0.0 && weight_a >= 0.0 && weight_b >= 0.0 && weight_c >= 0.0) {
    closest.offer(query, a + (ab * weight_b + ac * weight_c) / area);
  }
  closest.offer(query, closest_point_on_segment(query, a, b));
  closest.offer(query, closest_point_on_segment(query, a, c));
  closest.offer(query, closest_point_on_segment(query, b, c));
  return closest.point;
}

}  // namespace fanstream
