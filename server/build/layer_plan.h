// Where an asset's generations are cut into layers and slabs.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace fanstream {

struct LayerPlanOptions {
  std::uint32_t cell_vertices = 64;
  double slab_growth = 3.5;
  double segment_splits = 130.0;
};

struct LayerPlan {
  std::vector<std::uint8_t> layer_ends;  // AssetHead's
  std::vector<std::uint8_t> slab_ends;
};

// `vertices[g]` is the vertex count after generation g; vertices[0] is the base's. A slab ends where it has multiplied the
// vertices by slab_growth; a layer where a cell of average size has segment_splits. A remainder too small joins the last.
LayerPlan plan_layers(std::span<const std::uint32_t> vertices, const LayerPlanOptions& options);

}  // namespace fanstream
