#include "client/view/extent_parts.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

namespace fanstream {
namespace {

constexpr double kSlack = 1e-12;  // of what is rounded, relatively

struct Box {
  glm::dvec3 low, high;
  explicit Box(std::span<const glm::dvec3> points) : low(points.front()), high(points.front()) {
    for (const glm::dvec3& p : points) {
      low = glm::min(low, p);
      high = glm::max(high, p);
    }
  }
  int longest_axis() const {
    const glm::dvec3 size = high - low;
    if (size.x >= size.y && size.x >= size.z) return 0;
    return size.y >= size.z ? 1 : 2;
  }
};

ExtentPart around(std::span<const glm::dvec3> points, double margin) {
  const Box box(points);
  ExtentPart part{0.5 * (box.low + box.high), 0.0};
  for (const glm::dvec3& p : points) part.radius = std::max(part.radius, glm::distance(part.center, p));
  part.radius = (part.radius + margin) * (1.0 + kSlack);
  return part;
}

void divide(std::span<glm::dvec3> points, std::size_t count, double margin, std::vector<ExtentPart>& parts) {
  if (count == 1) {
    parts.push_back(around(points, margin));
    return;
  }
  const int axis = Box(points).longest_axis();
  const std::size_t middle = points.size() / 2;
  std::nth_element(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(middle), points.end(),
                   [axis](const glm::dvec3& a, const glm::dvec3& b) { return a[axis] < b[axis]; });
  divide(points.first(middle), count / 2, margin, parts);
  divide(points.subspan(middle), count / 2, margin, parts);
}

}  // namespace

std::vector<ExtentPart> parts_around(std::span<glm::dvec3> points, double margin) {
  std::size_t count = kMostParts;
  while (count > 1 && points.size() < count * kPointsOfPart) count /= 2;
  std::vector<ExtentPart> parts;
  if (count > 2) divide(points, count, margin, parts);
  return parts;
}

bool widen(std::span<ExtentPart> parts, std::span<const glm::dvec3> points, double margin) {
  bool grown = false;
  for (const glm::dvec3& p : points) {
    ExtentPart* best = nullptr;
    double least = std::numeric_limits<double>::infinity();  // that a part has to grow by
    for (ExtentPart& part : parts) {
      const double missing = glm::distance(part.center, p) + margin - part.radius;
      if (missing >= least) continue;
      least = missing;
      best = &part;
      if (least <= 0.0) break;
    }
    if (least > 0.0 && best != nullptr) grown |= enclose(best->center, best->radius, p, margin);
  }
  return grown;
}

bool enclose(glm::dvec3& center, double& radius, const glm::dvec3& other_center, double other_radius) {
  const glm::dvec3 offset = other_center - center;
  const double distance = glm::length(offset);
  if (distance + other_radius <= radius) return false;
  if (distance + radius <= other_radius) {
    center = other_center;
    radius = other_radius;
    return true;
  }
  const double both = 0.5 * (distance + radius + other_radius);
  center += offset * ((both - radius) / distance);
  radius = both * (1.0 + kSlack);
  return true;
}

}  // namespace fanstream
