// From a cleaned mesh to the bytes of an asset.
#pragma once

#include <functional>
#include <optional>
#include <span>

#include "common/asset/asset_layout.h"
#include "common/mesh/triangle_mesh.h"
#include "common/support/result.h"
#include "server/build/simplifier.h"
#include "server/build/split_training.h"

namespace fanstream {

struct BuildOptions {
  std::optional<int> position_bits;  // default: PositionGrid::default_bits
  // Merging stops here; a vertex of FM0 costs more bytes than a split. Default: a 256th of the model's, within 48..256.
  std::optional<std::uint32_t> base_vertices;
  // By default of the model's size: default_granularity.
  std::optional<double> cell_vertices;
  std::optional<double> slab_growth;
  std::optional<double> segment_splits;
  std::optional<double> edges_per_vertex;
  std::optional<double> evenness;         // SimplifyOptions::evenness
  std::optional<double> distance_growth;  // SimplifyOptions::distance_growth
  std::optional<double> fine_share;       // LevelOptions::fine_share; 1: generations stay as the simplifier makes them
  CostOptions cost;                       // what merges cost and where parents go
  double place_noise = 0.15;              // choose_precision's; 0: all places exact at every generation
  // By triangle of the mesh, the source's face that it is part of (CleanedMesh::source_faces): where it says anything,
  // the asset gets a section that tells which edges lie inside polygons. Has to live as long as the building.
  std::span<const std::uint32_t> source_faces = {};
  // From so many cells of the last slab on they are told by pages (AssetHead::has_pages): a page costs about three
  // bytes, 0.2 % of the asset in all, and saves a coarse view of a medium model a quarter of what it needs.
  std::uint32_t paged_cells = 96;
  // Called with the stage's name and the share of it that is done; may be empty.
  std::function<void(std::string_view stage, double fraction)> progress;
};

struct BuildReport {
  std::uint32_t vertices = 0, triangles = 0, components = 0;
  int position_bits = 0;
  std::uint32_t generations = 0, base_vertices = 0, base_triangles = 0, splits = 0, cells = 0, segments = 0;
  std::uint64_t total_bytes = 0, base_bytes = 0, split_bytes = 0, table_bytes = 0;
  std::uint64_t polygon_bytes = 0, quads = 0, larger_polygons = 0;  // faces of four corners, and of more
  double bits_per_vertex() const { return 8.0 * static_cast<double>(total_bytes) / vertices; }
};

struct BuiltAsset {
  std::vector<std::byte> bytes;
  BuildReport report;
};

// Precondition: `mesh` is an oriented manifold with at least one face (clean_mesh). Fails if it has more than
// kMostVertices vertices, if check_cost_options does, or if a stage reports an error. Deterministic: the same mesh and
// options give the same bytes, however many threads share the work. `progress` is called on the calling thread.
Result<BuiltAsset> build_asset(const TriangleMesh& mesh, const BuildOptions& options);

// How build_asset simplifies: what it is given, and its defaults for the rest.
SimplifyOptions simplify_options_of(const TriangleMesh& mesh, const BuildOptions& options);
// The merges that it codes: of large models in generations of their own (error_levels.h).
MergeHistory merge_history_of(const TriangleMesh& mesh, const BuildOptions& options);

// What a mesh's splits look like to the coder: the material that built-in statistics are made from.
Result<SplitSample> sample_splits(const TriangleMesh& mesh, const BuildOptions& options);

}  // namespace fanstream
