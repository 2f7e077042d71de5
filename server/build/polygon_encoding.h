// The polygon section of an asset: which edges of the full mesh lie inside polygons of the source.
#pragma once

#include <optional>

#include "common/asset/polygon_section.h"
#include "common/refine/fan_state.h"

namespace fanstream {

// `state` is the full mesh as replayed, in its cells, and `triangles` are the same ones in its numbers, of which
// `source_faces` tells the source's faces (ImportedMesh). Polygons that are no discs, or have more than
// kMostPolygonCorners, stay triangles. `cells`: by number, of AssetIndex. Nothing if no polygon is left.
std::optional<PolygonSection> encode_polygons(const FanState& state, const glm::vec3& unit, const AssetIndex& index,
                                              std::span<const Triangle> triangles,
                                              std::span<const std::uint32_t> source_faces);

}  // namespace fanstream
