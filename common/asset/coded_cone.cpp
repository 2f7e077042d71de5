#include "common/asset/coded_cone.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

namespace fanstream {
namespace {

constexpr double kStep = 12.0 * 3.14159265358979323846 / 180.0;
constexpr double kSlack = 1e-4;  // radians: single precision, here and where the axis is used

// Cigolle et al., "A survey of efficient representations for independent unit vectors", 2014.
glm::dvec2 unfold(const glm::dvec3& n) {
  const double sum = std::abs(n.x) + std::abs(n.y) + std::abs(n.z);
  const glm::dvec2 p(n.x / sum, n.y / sum);
  if (n.z >= 0.0) return p;
  return {std::copysign(1.0 - std::abs(p.y), p.x), std::copysign(1.0 - std::abs(p.x), p.y)};
}

glm::dvec3 fold(double x, double y) {
  const double z = 1.0 - std::abs(x) - std::abs(y);
  if (z < 0.0) {
    const double folded = std::copysign(1.0 - std::abs(y), x);
    y = std::copysign(1.0 - std::abs(x), y);
    x = folded;
  }
  return glm::normalize(glm::dvec3(x, y, z));
}

double place(std::uint8_t i) { return (2.0 * i + 1.0) / CodedCone::kPlaces - 1.0; }

std::uint8_t nearest_place(double x) {
  return static_cast<std::uint8_t>(
      std::clamp(std::floor((x + 1.0) * 0.5 * CodedCone::kPlaces), 0.0, CodedCone::kPlaces - 1.0));
}

}  // namespace

glm::vec3 CodedCone::axis() const { return glm::vec3(fold(place(u), place(v))); }

float CodedCone::cosine() const { return width == 0 ? -1.0F : static_cast<float>(std::cos(kStep * width)); }

bool CodedCone::holds(const glm::dvec3& direction) const {
  return width == 0 ||
         glm::dot(glm::dvec3(axis()), direction) >= static_cast<double>(cosine()) * glm::length(direction);
}

CodedCone code_cone(const glm::vec3& axis, float cosine) {
  if (!(cosine > -1.0F)) return {};
  const glm::dvec3 exact(axis);
  if (!(glm::dot(exact, exact) > 0.5)) return {};
  const glm::dvec2 at = unfold(exact);
  CodedCone coded{1, nearest_place(at.x), nearest_place(at.y)};
  const double off = std::acos(std::clamp(glm::dot(glm::normalize(exact), glm::dvec3(coded.axis())), -1.0, 1.0));
  const double half = std::acos(std::clamp(static_cast<double>(cosine), -1.0, 1.0)) + off + kSlack;
  const double steps = std::ceil(half / kStep);
  if (!(steps <= CodedCone::kWidest)) return {};
  coded.width = static_cast<std::uint8_t>(std::max(1.0, steps));
  return coded;
}

}  // namespace fanstream
