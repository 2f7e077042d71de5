#include "tests/bench/papers/curvature_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "client/render/plot.h"
#include "common/geometry/mesh_distance.h"
#include "server/build/asset_builder.h"
#include "tests/bench/level_quality.h"
#include "tests/bench/papers/papers_report.h"
#include "tests/bench/thread_clock.h"

namespace fanstream::bench {
namespace {

// What the source tells of a model: milliseconds on a Pentium III of 866 MHz.
struct SourceTimes {
  double quadric_ms, curvature_ms;
};

struct Subject {
  std::string name;
  std::string file;
  std::uint32_t start_vertices;  // reduced to so many first; 0: as it is
  std::uint32_t target_triangles;
  std::uint32_t largest_level;  // of the plot, in triangles
  std::optional<SourceTimes> source;
};

const std::array<Subject, 3>& subjects() {
  static const std::array<Subject, 3> all{
      Subject{"cow", "cow_2904v.off", 0, 120, 4000, SourceTimes{471, 480}},
      Subject{"dragon", "dragon_stanford_full.ply", 24'890, 500, 30'000, SourceTimes{5107, 6139}},
      Subject{"armadillo", "armadillo_86k.ply", 25'002, 500, 30'000, std::nullopt}};
  return all;
}

struct Way {
  std::string name;
  CostOptions cost;
};

std::vector<Way> ways(Quadrics quadrics) {
  std::vector<Way> all{
      {"quadric", {.cost = CostKind::quadric, .quadrics = quadrics, .valences = Valences::any}}};  // as the others
  for (const Curvature curvature : {Curvature::mean, Curvature::gaussian, Curvature::principal}) {
    all.push_back(
        {std::string(name_of(curvature)), {.cost = CostKind::curvature, .quadrics = quadrics, .curvature = curvature}});
  }
  return all;
}

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();  // printed as "-"

// A grid so fine that it does not show.
constexpr int kFineBits = 18;

class Levels {
 public:
  Levels(const TriangleMesh& mesh, const MergeHistory& history)
      : grid_(PositionGrid::fit(mesh.positions, kFineBits)),
        coded_(history, places_of(mesh), grid_),
        replay_(coded_, grid_, static_cast<std::uint32_t>(mesh.positions.size())) {}

  // Refines until there are at least so many triangles, or all of them. Precondition: never fewer than before.
  TriangleMesh at(std::size_t triangles, std::uint32_t full_vertices) {
    TriangleMesh mesh = replay_.mesh();
    while (mesh.triangles.size() < triangles && replay_.vertex_count() < full_vertices) {
      const std::size_t lack = (triangles - mesh.triangles.size() + 1) / 2;
      replay_.refine_to(
          static_cast<std::uint32_t>(std::min<std::size_t>(replay_.vertex_count() + lack, full_vertices)));
      mesh = replay_.mesh();
    }
    return mesh;
  }

 private:
  std::vector<GridPoint> places_of(const TriangleMesh& mesh) const {
    std::vector<GridPoint> places;
    for (const glm::dvec3& p : mesh.positions) places.push_back(grid_.encode(p));
    return places;
  }
  PositionGrid grid_;
  CodedHistory coded_;
  LevelReplay replay_;
};

Result<TriangleMesh> load(const PapersOptions& options, const Subject& subject) {
  Result<TriangleMesh> mesh = papers_mesh(options, subject.file);
  if (!mesh || subject.start_vertices == 0 || subject.start_vertices >= mesh->positions.size()) return mesh;
  SimplifyOptions simplify_options = simplify_options_of(*mesh, {});
  simplify_options.base_vertices = subject.start_vertices;
  const MergeHistory history = simplify(*mesh, simplify_options);
  return Levels(*mesh, history).at(0, 0);
}

// The fewest vertices that could have so few triangles are asked for; simplification stops where no merge is left.
SimplifyOptions down_to(const TriangleMesh& mesh, const Subject& subject, const CostOptions& cost) {
  BuildOptions build;
  build.cost = cost;
  const double excess = 0.5 * static_cast<double>(mesh.triangles.size()) - static_cast<double>(mesh.positions.size());
  build.base_vertices = static_cast<std::uint32_t>(std::max(4.0, std::round(0.5 * subject.target_triangles - excess)));
  return simplify_options_of(mesh, build);
}

struct Timing {
  double simplify_ms = std::numeric_limits<double>::infinity();
  double build_ms = std::numeric_limits<double>::infinity();
};

// Of all ways by turns.
Result<std::vector<Timing>> time_ways(const TriangleMesh& mesh, const Subject& subject, const std::vector<Way>& all,
                                      int repetitions) {
  std::vector<Timing> timings(all.size());
  for (int i = 0; i < repetitions; ++i) {
    for (std::size_t w = 0; w < all.size(); ++w) {
      const double start = thread_cpu_seconds();
      simplify(mesh, down_to(mesh, subject, all[w].cost));
      const double middle = thread_cpu_seconds();
      BuildOptions build;
      build.cost = all[w].cost;
      if (const Result<BuiltAsset> built = build_asset(mesh, build); !built) return tl::unexpected(built.error());
      timings[w].simplify_ms = std::min(timings[w].simplify_ms, 1e3 * (middle - start));
      timings[w].build_ms = std::min(timings[w].build_ms, 1e3 * (thread_cpu_seconds() - middle));
    }
  }
  return timings;
}

struct ErrorAt {
  std::size_t triangles = 0;
  double rms = 0.0, max = 0.0;
};

// From the target up, each level about a third larger than the one before.
Result<std::vector<ErrorAt>> errors_along(const TriangleMesh& mesh, const TriangleTree& tree, const Subject& subject,
                                          const CostOptions& cost, std::size_t face_samples) {
  const MergeHistory history = simplify(mesh, down_to(mesh, subject, cost));
  Levels levels(mesh, history);
  std::vector<ErrorAt> errors;
  const auto full = static_cast<std::uint32_t>(mesh.positions.size());
  for (double want = subject.target_triangles; want <= subject.largest_level; want *= 1.32) {
    const TriangleMesh level = levels.at(static_cast<std::size_t>(want), full);
    if (!errors.empty() && level.triangles.size() == errors.back().triangles) continue;
    const Result<MeshDistance> distance = mesh_distance(mesh, tree, level, {face_samples, 1});
    if (!distance) return tl::unexpected(distance.error());
    errors.push_back({level.triangles.size(), distance->relative_rms(), distance->relative_max()});
  }
  return errors;
}

Result<void> draw(const PapersOptions& options, const Subject& subject, std::size_t triangles,
                  const std::vector<std::pair<std::string, std::vector<ErrorAt>>>& curves) {
  std::vector<PlotSeries> series;
  for (const auto& [name, errors] : curves) {
    PlotSeries one{name, {}, false, name != "quadric", {}};
    for (const ErrorAt& e : errors) one.points.emplace_back(static_cast<double>(e.triangles), e.rms);
    series.push_back(std::move(one));
  }
  PlotOptions plot;
  plot.title = fmt::format("{}, from {} triangles: RMS error by cost", subject.name, triangles);
  plot.x = {"triangles", true, {}, {}};
  plot.y = {"RMS distance / diagonal, both ways", true, {}, {}};
  const Result<Image> image = draw_plot(series, plot);
  if (!image) return tl::unexpected(image.error());
  return write_png(*image, options.pictures / fmt::format("curvature-{}.png", subject.name));
}

Table time_table() {
  return Table({{"model", "", 0},
                {"triangles", "", 0},
                {"to", "", 0},
                {"quadrics", "", 0},
                {"cost", "", 0},
                {"simplify_ms", "simplify ms", 1},
                {"simplify_ratio", "/ quadric", 2},
                {"build_ms", "whole build ms", 1},
                {"build_ratio", "/ quadric", 2},
                {"source_ms", "source ms", 0},
                {"source_ratio", "source / QEM", 2}});
}

Table error_table() {
  return Table({{"model", "", 0},
                {"quadrics", "", 0},
                {"triangles", "", 0},
                {"rms_quadric", "rms: quadric", 2},
                {"rms_mean", "mean", 2},
                {"rms_gaussian", "gaussian", 2},
                {"rms_principal", "principal", 2},
                {"max_quadric", "max: quadric", 1},
                {"max_mean", "mean", 1},
                {"max_gaussian", "gaussian", 1},
                {"max_principal", "principal", 1}});
}

double source_ms(const Subject& subject, std::size_t way) {
  if (!subject.source || way > 1) return kNone;
  return way == 0 ? subject.source->quadric_ms : subject.source->curvature_ms;
}

class CurvatureTables {
 public:
  explicit CurvatureTables(const PapersOptions& options) : options_(options) {}

  Result<std::vector<Section>> run() {
    for (const Subject& subject : subjects()) {
      if (options_.progress) options_.progress("extended QEM: " + subject.name);
      const Result<TriangleMesh> mesh = load(options_, subject);
      if (!mesh) return tl::unexpected(mesh.error());
      if (Result<void> measured = measure(subject, *mesh); !measured) {
        return tl::unexpected(with_context(measured.error(), subject.file));
      }
    }
    return std::vector<Section>{
        {"curvature_time",
         "Extended QEM, time of one thread, the least of interleaved runs; beside it the source's (Pentium III, 866 "
         "MHz)",
         std::move(times_)},
        {"curvature_error",
         "Extended QEM, distance from the original along the way, both ways, in 1e-4 of the diagonal",
         std::move(errors_)}};
  }

 private:
  Result<void> measure(const Subject& subject, const TriangleMesh& mesh) {
    const Result<TriangleTree> tree = TriangleTree::build(mesh);
    if (!tree) return tl::unexpected(tree.error());
    for (const Quadrics quadrics : {Quadrics::memoryless, Quadrics::accumulated}) {
      const std::vector<Way> all = ways(quadrics);
      std::vector<std::pair<std::string, std::vector<ErrorAt>>> curves;
      for (const Way& way : all) {
        Result<std::vector<ErrorAt>> errors =
            errors_along(mesh, *tree, subject, way.cost, options_.quick ? 20'000 : 100'000);
        if (!errors) return tl::unexpected(errors.error());
        curves.emplace_back(way.name, std::move(*errors));
      }
      const Result<std::vector<Timing>> timings = time_ways(mesh, subject, all, options_.quick ? 3 : 15);
      if (!timings) return tl::unexpected(timings.error());
      add_times(subject, mesh, quadrics, all, *timings, curves);
      add_errors(subject, quadrics, curves);
      if (quadrics != Quadrics::memoryless) continue;
      if (Result<void> drawn = draw(options_, subject, mesh.triangles.size(), curves); !drawn) return drawn;
    }
    return {};
  }

  void add_times(const Subject& subject, const TriangleMesh& mesh, Quadrics quadrics, const std::vector<Way>& all,
                 const std::vector<Timing>& timings,
                 const std::vector<std::pair<std::string, std::vector<ErrorAt>>>& curves) {
    for (std::size_t w = 0; w < all.size(); ++w) {
      const double source = source_ms(subject, w);
      const double ratio = w == 1 ? source / source_ms(subject, 0) : kNone;
      times_.add_row({subject.name, whole(mesh.triangles.size()), whole(curves[w].second.front().triangles),
                      std::string(name_of(quadrics)), all[w].name, timings[w].simplify_ms,
                      timings[w].simplify_ms / timings[0].simplify_ms, timings[w].build_ms,
                      timings[w].build_ms / timings[0].build_ms, source, ratio});
    }
  }

  void add_errors(const Subject& subject, Quadrics quadrics,
                  const std::vector<std::pair<std::string, std::vector<ErrorAt>>>& curves) {
    for (const ErrorAt& of_quadric : curves[0].second) {
      std::vector<Cell> row{subject.name, std::string(name_of(quadrics)), whole(of_quadric.triangles)};
      std::vector<Cell> most;
      for (const auto& [name, errors] : curves) {
        // The level of about as many triangles, if that way got so far.
        const auto found = std::find_if(errors.begin(), errors.end(), [&](const ErrorAt& e) {
          return std::max(e.triangles, of_quadric.triangles) <=
                 1.03 * static_cast<double>(std::min(e.triangles, of_quadric.triangles));
        });
        row.emplace_back(found == errors.end() ? kNone : 1e4 * found->rms);
        most.emplace_back(found == errors.end() ? kNone : 1e4 * found->max);
      }
      row.insert(row.end(), most.begin(), most.end());
      errors_.add_row(std::move(row));
    }
  }

  const PapersOptions& options_;
  Table times_ = time_table();
  Table errors_ = error_table();
};

}  // namespace

Result<std::vector<Section>> measure_curvature(const PapersOptions& options) { return CurvatureTables(options).run(); }

}  // namespace fanstream::bench
