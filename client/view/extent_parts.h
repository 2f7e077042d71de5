// The spheres of which the convex hull holds a cell: made once, widened as the cell changes.
#pragma once

#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "client/view/criteria.h"

namespace fanstream {

// Spheres around groups of points that lie together: as many groups as make about kPointsOfPart each, a power of two,
// at most kMostParts; none where points are too few to be worth it. Each is larger than its points need by `margin`.
// Changes the order of the points.
std::vector<ExtentPart> parts_around(std::span<glm::dvec3> points, double margin);
inline constexpr std::size_t kMostParts = 16;
inline constexpr std::size_t kPointsOfPart = 3;

// Makes each point, with `margin` around it, lie in one of the parts: in that which has to grow least. Parts never
// shrink. Returns whether any has grown.
bool widen(std::span<ExtentPart> parts, std::span<const glm::dvec3> points, double margin);

// Makes a sphere hold another one too. Returns whether it had to grow.
bool enclose(glm::dvec3& center, double& radius, const glm::dvec3& other_center, double other_radius);

}  // namespace fanstream
