// All ways to order and place merges, for tests of what must hold of each.
#pragma once

#include <string>
#include <vector>

#include "common/mesh/triangle_mesh.h"
#include "server/build/cost_options.h"

namespace fanstream::testing {

// Each cost with each of its quadrics, curvatures and placements.
std::vector<CostOptions> every_cost();
std::string text_of(const CostOptions& options);

// E_dist + E_spring of the points from a mesh, by looking at every face for every point.
double fans_energy(const std::vector<glm::dvec3>& points, const TriangleMesh& mesh, double kappa);

}  // namespace fanstream::testing
