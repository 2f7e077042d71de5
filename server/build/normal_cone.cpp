#include "server/build/normal_cone.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace fanstream {

std::optional<WideCone> cone_around(std::span<const NormalCone> cones) {
  constexpr double kSlack = 1e-5;  // of single precision
  glm::dvec3 sum(0.0);
  for (const NormalCone& cone : cones) {
    if (!(cone.cosine > -1.0F)) return std::nullopt;
    sum += glm::dvec3(cone.axis);
  }
  const double length = glm::length(sum);
  if (!(length > 0.0)) return std::nullopt;
  const auto angle = [](double cosine) { return std::acos(std::clamp(cosine, -1.0, 1.0)); };
  WideCone all{sum / length, 0.0};
  for (const NormalCone& cone : cones) {
    const glm::dvec3 own = glm::normalize(glm::dvec3(cone.axis));
    all.half_angle = std::max(all.half_angle, angle(glm::dot(all.axis, own)) + angle(static_cast<double>(cone.cosine)));
  }
  all.half_angle += kSlack;
  return all;
}

}  // namespace fanstream
