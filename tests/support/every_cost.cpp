#include "tests/support/every_cost.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>
#include <set>

#include "common/geometry/closest_point.h"

namespace fanstream::testing {

std::vector<CostOptions> every_cost() {
  std::vector<CostOptions> all;
  for (const Placement place : {Placement::ends_middle, Placement::end, Placement::segment, Placement::optimal}) {
    all.push_back({.cost = CostKind::fans, .placement = place});
    all.push_back({.cost = CostKind::fans, .placement = place, .kappa = 0.0, .samples = 300});
    all.push_back({.cost = CostKind::fans, .placement = place, .valences = Valences::regular});
    all.push_back({.cost = CostKind::quadric, .placement = place, .valences = Valences::any});
    for (const Quadrics quadrics : {Quadrics::accumulated, Quadrics::memoryless}) {
      all.push_back({.cost = CostKind::quadric, .placement = place, .quadrics = quadrics});
      for (const Curvature curvature : {Curvature::mean, Curvature::gaussian, Curvature::principal}) {
        all.push_back({.cost = CostKind::curvature, .placement = place, .quadrics = quadrics, .curvature = curvature});
      }
    }
  }
  return all;
}

std::string text_of(const CostOptions& options) {
  std::string text(name_of(options.cost));
  const auto add = [&text](std::string_view name) { text.append(1, ' ').append(name); };
  add(name_of(options.placement));
  if (options.quadrics) add(name_of(*options.quadrics));
  if (options.curvature) add(name_of(*options.curvature));
  if (options.samples) add("with samples");
  if (options.valences) add(*options.valences == Valences::regular ? "regular valences" : "any valences");
  return text;
}

double fans_energy(const std::vector<glm::dvec3>& points, const TriangleMesh& mesh, double kappa) {
  double energy = 0.0;
  for (const glm::dvec3& x : points) {
    double least = std::numeric_limits<double>::infinity();
    for (const Triangle& t : mesh.triangles) {
      const glm::dvec3 off =
          closest_point_on_triangle(x, mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]) - x;
      least = std::min(least, glm::dot(off, off));
    }
    energy += least;
  }
  std::set<std::pair<VertexId, VertexId>> edges;
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) edges.insert(std::minmax(t[i], t[(i + 1) % 3]));
  }
  for (const auto& [a, b] : edges) {
    const glm::dvec3 edge = mesh.positions[b] - mesh.positions[a];
    energy += kappa * glm::dot(edge, edge);
  }
  return energy;
}

}  // namespace fanstream::testing
