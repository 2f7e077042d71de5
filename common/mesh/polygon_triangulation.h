// Polygons of the file formats into triangles.
#pragma once

#include <span>

#include "common/mesh/triangle_mesh.h"

namespace fanstream {

// Appends size - 2 triangles with the polygon's winding; nothing for fewer than three corners. Convex polygons become
// fans of their first corner. Concave ones are clipped ear by ear in the plane of their Newell normal, so that nothing
// is drawn outside them; where that fails (crossing edges, more than 256 corners) the rest becomes a fan.
// Every index must be in range. O(corners^2) at worst.
void triangulate_polygon(const std::vector<glm::dvec3>& positions, std::span<const VertexId> polygon,
                         std::vector<Triangle>& triangles);

}  // namespace fanstream
