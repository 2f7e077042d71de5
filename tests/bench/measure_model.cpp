#include "tests/bench/measure_model.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>

#include "common/fans/fan_cover.h"
#include "server/build/simplifier.h"
#include "tests/bench/cleaned_mesh.h"
#include "tests/bench/machine.h"
#include "tests/bench/thread_clock.h"

namespace fanstream::bench {

namespace {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Grid coordinates from the corner of the model's box, as on_grid() counts them.
std::array<std::int32_t, 3> grid_coordinates(const glm::dvec3& decoded, const glm::dvec3& corner, double step) {
  std::array<std::int32_t, 3> result{};
  for (int axis = 0; axis < 3; ++axis) {
    result[static_cast<std::size_t>(axis)] =
        static_cast<std::int32_t>(std::lround((decoded[axis] - corner[axis]) / step));
  }
  return result;
}

class Measurement {
 public:
  Measurement(const std::filesystem::path& path, const MeasureOptions& options) : path_(path), options_(options) {
    figures_.model = path.stem().string();
  }

  Result<ModelFigures> run() {
    for (const auto step : {&Measurement::build, &Measurement::open, &Measurement::decode, &Measurement::issued,
                            &Measurement::forced, &Measurement::quality}) {
      if (Result<void> done = (this->*step)(); !done) {
        // The importer's errors name the file already.
        const bool named = done.error().message.compare(0, path_.string().size(), path_.string()) == 0;
        return tl::unexpected(named ? done.error() : with_context(done.error(), path_.string()));
      }
    }
    return std::move(figures_);
  }

 private:
  void tell(std::string_view stage) const {
    if (options_.progress) options_.progress(stage);
  }

  Result<void> build() {
    tell("build on one processor");
    {
      const OnOneProcessor one;
      if (Result<void> built = build_once(); !built) return built;
      figures_.one_processor_seconds = one.holds() ? figures_.import_seconds + figures_.build_seconds : 0.0;
    }
    tell("build");
    return build_once();
  }

  Result<void> build_once() {
    bytes_ = {};
    reset_peak_memory();
    const Clock::time_point start = Clock::now();
    Result<TriangleMesh> mesh = cleaned_mesh(path_);
    if (!mesh) return tl::unexpected(mesh.error());
    mesh_ = std::move(*mesh);
    figures_.import_seconds = seconds_since(start);
    const Clock::time_point cleaned = Clock::now();
    build_options_.position_bits = options_.position_bits;
    build_options_.cost = options_.cost;
    Result<BuiltAsset> built = build_asset(mesh_, build_options_);
    if (!built) return tl::unexpected(built.error());
    figures_.build_seconds = seconds_since(cleaned);
    figures_.peak_memory_bytes = peak_memory_bytes();
    figures_.build = built->report;
    bytes_ = std::move(built->bytes);
    return {};
  }

  Result<void> open() {
    Result<std::shared_ptr<const OpenAsset>> asset = OpenAsset::open(bytes_, "the asset just built");
    if (!asset) return tl::unexpected(asset.error());
    asset_ = std::move(*asset);
    const PositionGrid& grid = asset_->asset_head()->grid;
    const glm::dvec3 corner = bounds_of(mesh_.positions).low;
    full_.triangles = quantised_.triangles = mesh_.triangles;
    for (const glm::dvec3& p : mesh_.positions) {
      full_.positions.push_back(grid.decode(grid.encode(p)));
      quantised_.positions.push_back(grid_coordinates(full_.positions.back(), corner, grid.step()));
    }
    figures_.regular_height_field = is_regular_height_field(mesh_);
    return compare_quantisers();
  }

  // Both round to the nearest point of the same grid; only where a vertex lies halfway between two may they disagree.
  Result<void> compare_quantisers() {
    const GridMesh theirs = on_grid(mesh_, static_cast<unsigned>(options_.position_bits));
    for (std::size_t v = 0; v < theirs.positions.size(); ++v) {
      if (theirs.positions[v] == quantised_.positions[v]) continue;
      ++figures_.quantised_otherwise;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (std::abs(theirs.positions[v][axis] - quantised_.positions[v][axis]) > 1) {
          return fail(ErrorKind::bad_input, "vertex " + std::to_string(v) + ": the asset's grid is not Draco's");
        }
      }
    }
    if (figures_.quantised_otherwise * 100 > theirs.positions.size()) {
      return fail(ErrorKind::bad_input,
                  std::to_string(figures_.quantised_otherwise) +
                      " vertices are quantised otherwise than by Draco; the sizes are not comparable");
    }
    return {};
  }

  Result<double> decode_ours(std::unique_ptr<ProgressiveMesh>& mesh, std::vector<Triangle>& triangles) const {
    const double start = thread_cpu_seconds();
    Result<std::unique_ptr<ProgressiveMesh>> rebuilt = rebuild_fully(bytes_, "the asset just built");
    if (!rebuilt) return tl::unexpected(rebuilt.error());
    mesh = std::move(*rebuilt);
    triangles = mesh->state().fans.triangles();
    return thread_cpu_seconds() - start;
  }

  Result<void> check_rebuilt(const ProgressiveMesh& mesh, std::vector<Triangle> triangles) const {
    GridMesh rebuilt{{}, std::move(triangles)};
    const glm::dvec3 corner = bounds_of(mesh_.positions).low;
    const PositionGrid& grid = mesh.head().grid;
    for (const GridPoint& place : mesh.state().places()) {
      rebuilt.positions.push_back(grid_coordinates(grid.decode(place), corner, grid.step()));
    }
    if (same_triangles(rebuilt, quantised_)) return {};
    return fail(ErrorKind::bad_input, "the rebuilt model is not the quantised input");
  }

  // Turn by turn, so that whatever else the machine does meets all of them.
  Result<void> decode() {
    tell("Draco");
    std::array<DracoFile, 2> files;
    for (const auto& [file, level] : {std::pair{&files[0], 7}, std::pair{&files[1], 10}}) {
      Result<DracoFile> made = make_draco_file(quantised_, level, 1);
      if (!made) return tl::unexpected(made.error());
      *file = std::move(*made);
    }
    tell("decode");
    std::vector<double> ours;
    std::array<std::vector<double>, 2> theirs;
    for (int i = 0; i < options_.repetitions; ++i) {
      {
        std::unique_ptr<ProgressiveMesh> mesh;
        std::vector<Triangle> triangles;
        const Result<double> seconds = decode_ours(mesh, triangles);
        if (!seconds) return tl::unexpected(seconds.error());
        ours.push_back(*seconds);
        if (i == 0) {
          if (Result<void> checked = check_rebuilt(*mesh, std::move(triangles)); !checked) return checked;
        }
      }
      for (std::size_t f = 0; f < files.size(); ++f) {
        const Result<double> seconds = decode_draco_file(files[f], quantised_);
        if (!seconds) return tl::unexpected(seconds.error());
        theirs[f].push_back(*seconds);
      }
    }
    figures_.decode_seconds = median(ours);
    for (std::size_t f = 0; f < files.size(); ++f) files[f].decode_seconds = median(theirs[f]);
    figures_.draco7 = draco_result(files[0], quantised_);
    figures_.draco10 = draco_result(files[1], quantised_);
    return {};
  }

  Result<void> count_issued(const ProgressiveMesh& mesh) {
    const TriangleMesh level = mesh.triangle_mesh();
    const Result<FanMesh> fans = cover_with_fans(level.positions.size(), level.triangles, CoverMethod::best);
    if (!fans) return tl::unexpected(fans.error());
    const double issued = fan_statistics(level.positions.size(), *fans).issued_per_vertex();
    if (issued > figures_.issued_per_vertex) {
      figures_.issued_per_vertex = issued;
      figures_.issued_worst_vertices = mesh.vertex_count();
      figures_.issued_worst_triangles = static_cast<std::uint32_t>(level.triangles.size());
    }
    figures_.issued_per_vertex_full = issued;
    return {};
  }

  // FM0 and the mesh after each layer, as a client that fetches layer by layer has them.
  Result<void> issued() {
    tell("fans");
    const AssetHead& head = *asset_->asset_head();
    ProgressiveMesh mesh(asset_->asset_head());
    mesh.set_index(asset_->asset_index());
    if (Result<void> counted = count_issued(mesh); !counted) return counted;
    for (std::uint32_t layer = 0; layer < head.layer_ends.size(); ++layer) {
      for (std::uint32_t c = 0; c < asset_->cell_count(); ++c) {
        const std::uint32_t first = head.layer_begin(asset_->asset_index()->cells[c].slab);
        if (layer < first || layer - first >= asset_->segment_count(c)) continue;
        if (Result<void> added = mesh.add_segment(c, layer - first, asset_->segment(c, layer - first)); !added) {
          return added;
        }
      }
      if (const Result<std::uint64_t> refined = mesh.refine(); !refined) return tl::unexpected(refined.error());
      if (Result<void> counted = count_issued(mesh); !counted) return counted;
    }
    if (!mesh.is_complete()) return fail(ErrorKind::bad_input, "all layers do not make the whole model");
    return {};
  }

  Result<void> forced() {
    tell("forced share");
    const Result<SplitDependencies> dependencies = SplitDependencies::of(asset_);
    if (!dependencies) return tl::unexpected(dependencies.error());
    figures_.disc1 = forced_share(*dependencies, 0.01, options_.disc_seeds);
    figures_.disc10 = forced_share(*dependencies, 0.10, options_.disc_seeds);
    return {};
  }

  Result<void> quality() {
    tell("levels");
    const MergeHistory history = merge_history_of(mesh_, build_options_);
    if (history.base_vertices != figures_.build.base_vertices ||
        history.generation_count() != figures_.build.generations) {
      return fail(ErrorKind::bad_input,
                  "merge_history_of() gave " + std::to_string(history.base_vertices) + " base vertices in " +
                      std::to_string(history.generation_count()) + " generations, the asset has " +
                      std::to_string(figures_.build.base_vertices) + " in " +
                      std::to_string(figures_.build.generations) + "; that is not what build_asset() does");
    }
    const PositionGrid& grid = asset_->asset_head()->grid;
    std::vector<GridPoint> places;
    for (const glm::dvec3& p : mesh_.positions) places.push_back(grid.encode(p));
    const CodedHistory coded(history, std::move(places), grid, asset_->asset_head()->precision);
    Result<std::vector<LevelQuality>> levels =
        measure_levels(full_, mesh_, coded, grid, options_.level_shares, options_.face_samples);
    if (!levels) return tl::unexpected(levels.error());
    figures_.levels = std::move(*levels);
    return {};
  }

  const std::filesystem::path& path_;
  const MeasureOptions& options_;
  BuildOptions build_options_;
  ModelFigures figures_;
  TriangleMesh mesh_;   // cleaned
  TriangleMesh full_;   // the same on the grid, in the model's coordinates
  GridMesh quantised_;  // the same in grid coordinates
  std::vector<std::byte> bytes_;
  std::shared_ptr<const OpenAsset> asset_;
};

}  // namespace

double ModelFigures::base_limit() const { return std::max(400.0, 0.01 * build.vertices) + 4.0 * build.components; }

bool is_regular_height_field(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> valence(mesh.positions.size(), 0);
  std::array<std::size_t, 3> up{};
  for (const Triangle& t : mesh.triangles) {
    for (const VertexId v : t) ++valence[v];
    const glm::dvec3 edge = mesh.positions[t[1]] - mesh.positions[t[0]];
    const glm::dvec3 normal = glm::cross(edge, mesh.positions[t[2]] - mesh.positions[t[0]]);
    for (int axis = 0; axis < 3; ++axis) up[static_cast<std::size_t>(axis)] += normal[axis] > 0.0 ? 1 : 0;
  }
  const auto six = static_cast<std::size_t>(std::count(valence.begin(), valence.end(), 6U));
  const std::size_t few = mesh.triangles.size() / 100;
  return six * 10 >= mesh.positions.size() * 9 &&
         std::any_of(up.begin(), up.end(), [&](std::size_t n) { return n <= few || n + few >= mesh.triangles.size(); });
}

bool same_triangles(const GridMesh& a, const GridMesh& b) {
  using Place = std::array<std::int32_t, 3>;
  const auto sorted = [](const GridMesh& mesh) {
    std::vector<std::array<Place, 3>> triangles;
    triangles.reserve(mesh.triangles.size());
    for (const Triangle& t : mesh.triangles) {
      std::array<Place, 3> corners{mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]};
      // Of the three rotations the smallest: places may coincide, so the smallest corner alone does not tell.
      std::array<Place, 3> best = corners;
      for (int i = 0; i < 2; ++i) {
        std::rotate(corners.begin(), corners.begin() + 1, corners.end());
        best = std::min(best, corners);
      }
      triangles.push_back(best);
    }
    std::sort(triangles.begin(), triangles.end());
    return triangles;
  };
  return sorted(a) == sorted(b);
}

Result<ModelFigures> measure_model(const std::filesystem::path& path, const MeasureOptions& options) {
  return Measurement(path, options).run();
}

}  // namespace fanstream::bench
