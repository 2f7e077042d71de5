// Where an asset's generations are cut into layers and slabs.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace fanstream {

// How finely a model is cut. Smaller pieces follow a view more closely and cost more bytes.
struct Granularity {
  double cell_vertices = 48.0;  // that a cell starts with
  // How much a slab of generations multiplies the vertices: a cell of more slabs is cut into smaller cells as it grows.
  double slab_growth = 4.0;
  double segment_splits = 16.0;   // generations are joined into a layer until a cell's segment has so many
  double edges_per_vertex = 1.5;  // SimplifyOptions::edges_per_vertex
  double evenness = 0.0;          // SimplifyOptions::evenness
  double distance_growth = 0.0;   // SimplifyOptions::distance_growth
  double fine_share = 1.0;        // LevelOptions::fine_share; 1: generations stay as the simplifier makes them
};

// A view shows all of a small model, but a small part of a large one, or all of it coarsely: what it needs beyond that,
// be it because something depends on it or because a cell has one place that is further off than the rest, weighs more
// then than the bytes of tables. So from 20,000 to 40,000 vertices errors become even and layers finer, and from 50,000
// to 400,000 cells small. From 1,000 to 100,000 vertices what a merge may leave is limited, the more strictly the
// larger the model; from 20,000 on evenness need not do all then, which pays for the bytes. Beyond, it would double the
// time of a build that takes seconds. Measured in tests/bench/RESULTS.md.
Granularity default_granularity(std::uint32_t vertex_count);

struct LayerPlan {
  std::vector<std::uint8_t> layer_ends;  // AssetHead's
  std::vector<std::uint8_t> slab_ends;
};

// `vertices[g]` is the vertex count after generation g; vertices[0] is the base's. A slab ends where it has multiplied
// the vertices by slab_growth; a layer where a cell of average size has segment_splits. A remainder too small joins the
// last.
LayerPlan plan_layers(std::span<const std::uint32_t> vertices, const Granularity& options);

}  // namespace fanstream
