#include "tests/bench/cost_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "common/geometry/mesh_distance.h"
#include "common/mesh/mesh_hash.h"
#include "tests/bench/cleaned_mesh.h"
#include "tests/bench/level_quality.h"
#include "tests/bench/machine.h"
#include "tests/bench/thread_clock.h"

namespace fanstream::bench {
namespace {

class CostMeasurement {
 public:
  CostMeasurement(const TriangleMesh& mesh, const TriangleMesh& full, const TriangleTree& tree,
                  const CostTableOptions& options)
      : mesh_(mesh), full_(full), tree_(tree), options_(options) {}

  Result<CostFigures> run(const CostOptions& cost) {
    CostFigures figures;
    figures.cost = cost;
    const OnOneProcessor one;  // on several the build has threads of its own
    const double start = thread_cpu_seconds();
    Result<BuiltAsset> built = build_asset(mesh_, options_for(cost));
    if (!built) return tl::unexpected(built.error());
    figures.build_cpu_seconds = thread_cpu_seconds() - start;
    figures.build = built->report;
    Result<std::shared_ptr<const OpenAsset>> asset = OpenAsset::open(std::move(built->bytes), "the asset just built");
    if (!asset) return tl::unexpected(asset.error());
    Result<std::vector<RatePoint>> curve = curve_of(**asset);
    if (!curve) return tl::unexpected(curve.error());
    for (const double rms : options_.rms) figures.bytes_at_rms.push_back(bytes_at_rms(*curve, rms));
    if (Result<void> levels = measure_levels_of(cost, **asset, figures); !levels) return tl::unexpected(levels.error());
    return figures;
  }

 private:
  BuildOptions options_for(const CostOptions& cost) const {
    BuildOptions options;
    options.position_bits = options_.position_bits;
    options.cost = cost;
    return options;
  }

  Result<MeshDistance> distance_to(const TriangleMesh& level) const {
    return mesh_distance(full_, tree_, level, {options_.face_samples, 1});
  }

  // FM0 and the end of each layer. At the end it must be the input.
  Result<std::vector<RatePoint>> curve_of(const OpenAsset& asset) const {
    const AssetHead& head = *asset.asset_head();
    ProgressiveMesh mesh(asset.asset_head());
    mesh.set_index(asset.asset_index());
    std::vector<RatePoint> curve;
    std::size_t bytes = asset.head().size() + asset.index().size();
    for (std::uint32_t layer = 0; layer <= head.layer_ends.size(); ++layer) {
      const Result<MeshDistance> distance = distance_to(mesh.triangle_mesh());
      if (!distance) return tl::unexpected(distance.error());
      curve.push_back({static_cast<double>(bytes), distance->relative_rms()});
      if (layer == head.layer_ends.size()) break;
      for (std::uint32_t c = 0; c < asset.cell_count(); ++c) {
        const std::uint32_t first = head.layer_begin(asset.asset_index()->cells[c].slab);
        if (layer < first || layer - first >= asset.segment_count(c)) continue;
        bytes += asset.segment(c, layer - first).size();
        if (Result<void> added = mesh.add_segment(c, layer - first, asset.segment(c, layer - first)); !added) {
          return tl::unexpected(added.error());
        }
      }
      if (const Result<std::uint64_t> refined = mesh.refine(); !refined) return tl::unexpected(refined.error());
    }
    if (mesh_hash(mesh.triangle_mesh()) != mesh_hash(full_)) {
      return fail(ErrorKind::bad_input, "the rebuilt model is not the quantised input");
    }
    return curve;
  }

  Result<void> measure_levels_of(const CostOptions& cost, const OpenAsset& asset, CostFigures& figures) const {
    const MergeHistory history = simplify(mesh_, simplify_options_of(mesh_, options_for(cost)));
    const PositionGrid& grid = asset.asset_head()->grid;
    std::vector<GridPoint> places;
    for (const glm::dvec3& p : mesh_.positions) places.push_back(grid.encode(p));
    const CodedHistory coded(history, std::move(places), grid);
    LevelReplay replay(coded, grid, static_cast<std::uint32_t>(mesh_.positions.size()));
    std::vector<double> ascending = options_.level_shares;
    std::sort(ascending.begin(), ascending.end());
    for (const double share : ascending) {
      constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
      CostLevel level{share, kNone, kNone};
      const auto vertices =
          static_cast<std::uint32_t>(std::lround(share * static_cast<double>(mesh_.positions.size())));
      if (vertices >= replay.vertex_count()) {
        replay.refine_to(vertices);
        const Result<MeshDistance> distance = distance_to(replay.mesh());
        if (!distance) return tl::unexpected(distance.error());
        level.rms = distance->relative_rms();
        level.max = distance->relative_max();
      }
      figures.levels.insert(figures.levels.begin(), level);
    }
    return {};
  }

  const TriangleMesh& mesh_;
  const TriangleMesh& full_;  // on the grid
  const TriangleTree& tree_;
  const CostTableOptions& options_;
};

std::string short_percent(double share) { return fmt::format("{:g} %", 100.0 * share); }

// Ratios of a row's figures to the first cost's of the same model.
class Means {
 public:
  explicit Means(std::size_t figures) : logs_(figures, 0.0), counts_(figures, 0) {}
  void add(const std::vector<double>& row, const std::vector<double>& first) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      if (!(row[i] > 0.0) || !(first[i] > 0.0)) continue;
      logs_[i] += std::log(row[i] / first[i]);
      ++counts_[i];
    }
  }
  double mean(std::size_t i) const {
    return counts_[i] == 0 ? std::numeric_limits<double>::quiet_NaN() : std::exp(logs_[i] / counts_[i]);
  }

 private:
  std::vector<double> logs_;
  std::vector<int> counts_;
};

std::vector<double> numbers_of(const CostFigures& f) {
  std::vector<double> numbers{static_cast<double>(f.build.total_bytes)};
  for (const auto& bytes : f.bytes_at_rms) numbers.push_back(bytes.value_or(std::numeric_limits<double>::quiet_NaN()));
  for (const CostLevel& level : f.levels) numbers.push_back(1e4 * level.rms);
  for (const CostLevel& level : f.levels) numbers.push_back(1e4 * level.max);
  numbers.push_back(f.build_cpu_seconds);
  return numbers;
}

Table table_for(const CostTableOptions& options, int decimals) {
  std::vector<Column> columns{{"cost", "", 0}, {"bytes", "", decimals == 3 ? 3 : 0}};
  for (const double rms : options.rms) {
    columns.push_back({fmt::format("bytes_to_rms_{:g}", rms), fmt::format("to {:g}", rms), decimals == 3 ? 3 : 0});
  }
  for (const char* what : {"rms", "max"}) {
    for (const double share : options.level_shares) {
      columns.push_back(
          {fmt::format("{}_{:g}", what, share), fmt::format("{} {}", what, short_percent(share)), decimals});
    }
  }
  columns.push_back({"build_cpu_s", "build s", decimals});
  return Table(std::move(columns));
}

std::vector<Cell> row_of(const std::string& name, const std::vector<double>& numbers) {
  std::vector<Cell> cells{name};
  for (const double number : numbers) cells.emplace_back(number);
  return cells;
}

}  // namespace

std::string text_of(const CostOptions& cost) {
  std::string text(name_of(cost.cost));
  if (cost.curvature) text += fmt::format(" {}", name_of(*cost.curvature));
  if (cost.quadrics) text += fmt::format(" {}", name_of(*cost.quadrics));
  if (cost.valences) text += fmt::format(", {} valences", name_of(*cost.valences));
  if (cost.kappa) text += fmt::format(" kappa {:g}", *cost.kappa);
  if (cost.samples) text += fmt::format(" samples {}", *cost.samples);
  return fmt::format("{}, {}", text, name_of(cost.placement));
}

std::vector<CostOptions> all_costs() {
  std::vector<CostOptions> all;
  const auto add = [&](CostOptions options) {
    for (const Placement placement : {Placement::ends_middle, Placement::end, Placement::segment, Placement::optimal}) {
      options.placement = placement;
      all.push_back(options);
    }
  };
  add({.cost = CostKind::quadric});
  all.push_back({.cost = CostKind::quadric, .valences = Valences::any});
  add({.cost = CostKind::quadric, .quadrics = Quadrics::accumulated});
  for (const Curvature curvature : {Curvature::mean, Curvature::gaussian, Curvature::principal}) {
    add({.cost = CostKind::curvature, .curvature = curvature});
  }
  add({.cost = CostKind::curvature, .quadrics = Quadrics::accumulated});
  add({.cost = CostKind::fans});
  return all;
}

Result<std::vector<CostFigures>> measure_costs(const std::filesystem::path& path, const CostTableOptions& options) {
  const Result<TriangleMesh> mesh = cleaned_mesh(path);
  if (!mesh) return tl::unexpected(mesh.error());
  const PositionGrid grid = PositionGrid::fit(mesh->positions, options.position_bits);
  TriangleMesh full = *mesh;
  for (glm::dvec3& p : full.positions) p = grid.decode(grid.encode(p));
  const Result<TriangleTree> tree = TriangleTree::build(full);
  if (!tree) return tl::unexpected(with_context(tree.error(), path.string()));
  CostMeasurement measurement(*mesh, full, *tree, options);
  std::vector<CostFigures> all;
  for (const CostOptions& cost : options.costs) {
    if (options.progress) options.progress(text_of(cost));
    Result<CostFigures> figures = measurement.run(cost);
    if (!figures) return tl::unexpected(with_context(figures.error(), path.string() + ": " + text_of(cost)));
    figures->model = path.stem().string();
    all.push_back(std::move(*figures));
  }
  return all;
}

std::vector<Section> cost_sections(const std::vector<CostFigures>& figures, const CostTableOptions& options) {
  std::vector<std::string> models;
  std::map<std::string, std::vector<const CostFigures*>> by_model;
  for (const CostFigures& f : figures) {
    if (by_model[f.model].empty()) models.push_back(f.model);
    by_model[f.model].push_back(&f);
  }
  std::vector<Section> sections;
  std::vector<Means> means;
  for (const std::string& model : models) {
    Table table = table_for(options, 2);
    const std::vector<double> first = numbers_of(*by_model[model].front());
    means.resize(std::max(means.size(), by_model[model].size()), Means(first.size()));
    for (std::size_t i = 0; i < by_model[model].size(); ++i) {
      const std::vector<double> numbers = numbers_of(*by_model[model][i]);
      means[i].add(numbers, first);
      table.add_row(row_of(text_of(by_model[model][i]->cost), numbers));
    }
    sections.push_back({"costs_" + model,
                        model +
                            ": bytes of the asset and up to an RMS error (of the diagonal); errors of levels at shares "
                            "of the vertices, both ways, in 1e-4 of the diagonal",
                        std::move(table)});
  }
  if (models.size() < 2) return sections;
  Table table = table_for(options, 3);
  for (std::size_t i = 0; i < options.costs.size() && i < means.size(); ++i) {
    std::vector<double> ratios;
    for (std::size_t k = 0; k < 2 + options.rms.size() + 2 * options.level_shares.size(); ++k) {
      ratios.push_back(means[i].mean(k));
    }
    table.add_row(row_of(text_of(options.costs[i]), ratios));
  }
  sections.push_back({"costs_all", "All models: geometric means of the ratios to the first row", std::move(table)});
  return sections;
}

}  // namespace fanstream::bench
