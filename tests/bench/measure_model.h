// Everything that fanstream-bench tells of one model, measured in one run.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "server/build/asset_builder.h"
#include "tests/bench/draco_peer.h"
#include "tests/bench/forced_share.h"
#include "tests/bench/level_quality.h"

namespace fanstream::bench {

struct MeasureOptions {
  int position_bits = 12;
  CostOptions cost;
  int repetitions = 25;  // of decoding, ours and Draco's in turn; the medians count
  std::uint32_t disc_seeds = 16;
  std::size_t face_samples = 200'000;
  std::vector<double> level_shares{0.5, 0.25, 0.1, 0.05, 0.01};
  std::function<void(std::string_view stage)> progress;  // may be empty
};

struct ModelFigures {
  std::string model;  // the file's name without folder and extension
  BuildReport build;
  bool regular_height_field = false;  // sampled in rows and columns over a plane of two axes
  // Vertices whose grid point differs between the asset's grid and Draco's own quantiser: ties only.
  std::uint64_t quantised_otherwise = 0;
  double import_seconds = 0.0;  // reading and cleaning
  double build_seconds = 0.0;   // from the cleaned mesh to the asset's bytes
  // Of both, with all threads on one processor; 0 where the system cannot hold them there.
  double one_processor_seconds = 0.0;
  std::uint64_t peak_memory_bytes = 0;
  double decode_seconds = 0.0;  // from the asset's bytes to an index buffer of the full model; CPU time, as Draco's
  DracoResult draco7, draco10;
  ForcedShare disc1, disc10;       // 1 % and 10 % of the vertices
  double issued_per_vertex = 0.0;  // the largest of all layer ends, FM0 included
  std::uint32_t issued_worst_vertices = 0;
  std::uint32_t issued_worst_triangles = 0;
  double issued_per_vertex_full = 0.0;  // of the full model
  std::vector<LevelQuality> levels;

  double build_mtriangles_s() const { return build.triangles / (import_seconds + build_seconds) * 1e-6; }
  double build_mtriangles_one_s() const { return build.triangles / one_processor_seconds * 1e-6; }
  double decode_mtriangles_s() const { return build.triangles / decode_seconds * 1e-6; }
  double size_ratio() const { return static_cast<double>(build.total_bytes) / static_cast<double>(draco10.size_bytes); }
  double decode_ratio() const { return draco10.decode_seconds / decode_seconds; }
  // Figure 1 of the issue: 400 or 1 % where that is more, plus 4 per component.
  double base_limit() const;
};

// Imports, cleans, builds, decodes and compares. Fails where the rebuilt model is not the quantised input face for
// face, or where the asset's grid and Draco's differ by more than ties. Single-threaded.
Result<ModelFigures> measure_model(const std::filesystem::path& path, const MeasureOptions& options);

// Whether nine vertices in ten have six triangles, and hardly a triangle faces back along one of the axes. The mesh is
// an oriented manifold.
bool is_regular_height_field(const TriangleMesh& mesh);

// Whether two meshes have the same triangles as places on the grid: any numbering, any order, the same winding.
bool same_triangles(const GridMesh& a, const GridMesh& b);

}  // namespace fanstream::bench
