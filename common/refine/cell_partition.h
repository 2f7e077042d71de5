// How a cell's vertices fall to its children when its slab is complete.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/coding/fan_vertex.h"
#include "common/grid/position_grid.h"

namespace fanstream {

// Cuts the vertices into `parts` compact groups of nearly equal size: halved across the longest axis of their box, over
// and over (a kd-tree; ties by their order, which is that of their numbers in the asset). Depends on places and order
// only, so that builder and client agree without a byte being sent. Every group keeps the order. Fewer vertices than
// parts leave groups empty.
std::vector<std::vector<VertexId>> partition_vertices(std::span<const VertexId> vertices,
                                                      std::span<const FanVertex> places, const glm::vec3& unit,
                                                      std::uint32_t parts);

}  // namespace fanstream
