#include "tests/bench/papers/fans_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "common/fans/fan_shape.h"
#include "common/geometry/mesh_distance.h"
#include "tests/bench/papers/ellipsoid.h"
#include "tests/bench/papers/fans_pictures.h"
#include "tests/bench/papers/fewest_fans.h"
#include "tests/bench/papers/our_levels.h"
#include "tests/bench/papers/papers_report.h"
#include "tests/bench/papers/single_generation.h"

namespace fanstream::bench {
namespace {

constexpr double kMostIssuedPerVertex = 2.75;

// E_dist + E_spring over the vertices; the best of both ends and the middle.
const CostOptions kPaperCost{CostKind::fans, Placement::ends_middle, {}, {}, {}, {}, 1};

// A line of the paper's tables 1 to 3.
struct PrintedLevel {
  std::uint32_t level, vertices, fans, issued, isolated;
};
struct PrintedModel {
  const char* name;
  std::array<PrintedLevel, 3> levels;
};
constexpr PrintedModel kEllipsoid{"ellipsoid",
                                  {{{0, 283, 92, 790, 44}, {58, 341, 150, 1080, 44}, {119, 402, 211, 1222, 44}}}};
constexpr PrintedModel kVenus{"Venus",
                              {{{0, 530, 270, 1764, 168}, {80, 610, 350, 2164, 168}, {181, 711, 451, 2320, 168}}}};
constexpr PrintedModel kPig{
    "pig", {{{0, 2517, 1259, 8437, 889}, {441, 2958, 1700, 10642, 889}, {1005, 3522, 2264, 11568, 889}}}};

struct Subject {
  std::string name;
  TriangleMesh mesh;
  const PrintedModel* printed = nullptr;
  std::string picture{};  // file name; none if empty
  glm::dvec3 seen_from{0.5, 0.4, 1.0};
  bool is_limited = false;  // kMostIssuedPerVertex is for it
};

struct Level {
  std::string level;
  FanStatistics statistics;
  double rms = 0.0;  // relative to the diagonal
  FanMesh fans;
};

struct Worst {
  double issued_per_vertex = 0.0;
  std::uint32_t vertices = 0;
  double least = 0.0;      // that level cannot be drawn with fewer
  std::size_t levels = 0;  // looked at
  std::size_t above = 0;   // of these above kMostIssuedPerVertex
};

struct Figures {
  std::vector<Level> single, ours;  // coarse to fine; of ours those at the same numbers of vertices come last
  std::size_t ours_coarser = 0;     // so many come before
  Worst worst;                      // of our levels at all numbers of vertices
};

double issued_per_vertex(std::size_t vertices, std::size_t faces, std::size_t fans) {
  return static_cast<double>(faces + 2 * fans) / static_cast<double>(vertices);
}

class Measurement {
 public:
  Measurement(const Subject& subject, const PapersOptions& options) : subject_(subject), options_(options) {}

  Result<Figures> run() {
    Result<TriangleTree> tree = TriangleTree::build(subject_.mesh);
    if (!tree) return tl::unexpected(tree.error());
    tree_ = std::make_shared<const TriangleTree>(std::move(*tree));
    tell("one generation, as the paper");
    if (Result<void> done = measure_single(); !done) return tl::unexpected(done.error());
    tell("our generations");
    if (Result<void> done = measure_ours(); !done) return tl::unexpected(done.error());
    tell("all our levels");
    if (Result<void> done = find_worst(); !done) return tl::unexpected(done.error());
    return std::move(figures_);
  }

 private:
  void tell(const char* stage) const { options_.progress(subject_.name + ": " + stage); }

  Result<Level> measured(std::string name, const TriangleMesh& mesh, FanMesh fans) const {
    if (Result<void> checked = check_cover(mesh.triangles, fans); !checked) return tl::unexpected(checked.error());
    const std::size_t samples = options_.quick ? 20'000 : 200'000;
    const Result<MeshDistance> distance = mesh_distance(subject_.mesh, *tree_, mesh, {samples, 1});
    if (!distance) return tl::unexpected(distance.error());
    set_normals(fans);
    return Level{std::move(name), fan_statistics(mesh.positions.size(), fans), distance->relative_rms(),
                 std::move(fans)};
  }

  Result<void> measure_single() {
    const auto made = SingleGeneration::build(subject_.mesh, kPaperCost);
    if (!made) return tl::unexpected(made.error());
    SingleGeneration& single = **made;
    const std::size_t finest = single.level_count() - 1;
    for (const std::size_t level : {std::size_t{0}, finest / 2, finest}) {
      single.go_to(level);
      Result<Level> result = measured(std::to_string(level), single.mesh(), single.fans());
      if (!result) return tl::unexpected(result.error());
      figures_.single.push_back(std::move(*result));
    }
    return {};
  }

  // FM0, two between it and the single generation's coarsest, and the single generation's numbers of vertices.
  Result<void> measure_ours() {
    Result<std::unique_ptr<OurLevels>> built = OurLevels::build(subject_.mesh);
    if (!built) return tl::unexpected(built.error());
    OurLevels& ours = **built;
    const double base = ours.base_vertices();
    const double ratio = static_cast<double>(figures_.single.front().statistics.vertices) / base;
    std::vector<std::uint32_t> counts;
    for (const double part : {0.0, 1.0 / 3.0, 2.0 / 3.0}) {
      const auto count = static_cast<std::uint32_t>(std::lround(base * std::pow(ratio, part)));
      if (counts.empty() || count > counts.back()) counts.push_back(count);
    }
    figures_.ours_coarser = counts.size();
    for (const Level& level : figures_.single) counts.push_back(static_cast<std::uint32_t>(level.statistics.vertices));
    for (std::size_t i = 0; i < counts.size(); ++i) {
      const TriangleMesh mesh = ours.level(std::max(counts[i], ours.base_vertices()));
      Result<FanMesh> fans = make_fan_mesh(mesh);
      if (!fans) return tl::unexpected(fans.error());
      Result<Level> result = measured(i == 0 ? "FM0" : "", mesh, std::move(*fans));
      if (!result) return tl::unexpected(result.error());
      figures_.ours.push_back(std::move(*result));
    }
    return {};
  }

  // At every number of vertices if the mesh is small.
  Result<void> find_worst() {
    Result<std::unique_ptr<OurLevels>> ours =
        OurLevels::build(subject_.mesh, static_cast<std::uint32_t>(figures_.ours.front().statistics.vertices));
    if (!ours) return tl::unexpected(ours.error());
    const auto full = static_cast<std::uint32_t>(subject_.mesh.positions.size());
    const std::uint32_t levels = options_.quick ? 50 : 1000;
    const std::uint32_t step = std::max(1U, (full - (*ours)->base_vertices()) / levels);
    std::vector<Triangle> triangles;
    for (std::uint32_t count = (*ours)->base_vertices(); count <= full; count += step) {
      TriangleMesh mesh = (*ours)->level(count);
      const Result<FanMesh> fans = cover_with_fans(count, mesh.triangles);
      if (!fans) return tl::unexpected(fans.error());
      const double issued = fan_statistics(count, *fans).issued_per_vertex();
      Worst& worst = figures_.worst;
      ++worst.levels;
      worst.above += issued > kMostIssuedPerVertex ? 1 : 0;
      if (issued <= worst.issued_per_vertex) continue;
      worst.issued_per_vertex = issued;
      worst.vertices = count;
      triangles = std::move(mesh.triangles);
    }
    Worst& worst = figures_.worst;
    const std::size_t least = std::max(least_fans(worst.vertices, triangles),
                                       fewest_centers(worst.vertices, triangles).value_or(std::size_t{0}));
    worst.least = issued_per_vertex(worst.vertices, triangles.size(), least);
    return {};
  }

  const Subject& subject_;
  const PapersOptions& options_;
  std::shared_ptr<const TriangleTree> tree_;
  Figures figures_;
};

void add_printed(const PrintedModel& model, Table& table) {
  for (const PrintedLevel& level : model.levels) {
    const std::size_t faces = 2 * std::size_t{level.vertices} - 4;
    table.add_row({std::string(model.name), std::string("paper, printed"), std::to_string(level.level),
                   whole(level.vertices), whole(level.fans), whole(level.issued), whole(level.isolated),
                   static_cast<double>(level.issued) / level.vertices,
                   issued_per_vertex(level.vertices, faces, level.fans), std::monostate{}});
  }
}

void add_levels(const std::string& name, const char* scheme, const std::vector<Level>& levels, Table& table) {
  for (const Level& level : levels) {
    const FanStatistics& s = level.statistics;
    table.add_row({name, std::string(scheme), level.level, whole(s.vertices), whole(s.fans), whole(s.issued_vertices),
                   whole(s.isolated_triangles), s.issued_per_vertex(), issued_per_vertex(s.vertices, s.faces, s.fans),
                   1e3 * level.rms});
  }
}

Section levels_section(const std::vector<Subject>& subjects, const std::vector<Figures>& figures) {
  Table table({{"mesh", "", 0},
               {"scheme", "", 0},
               {"level", "", 0},
               {"vertices", "", 0},
               {"fans", "", 0},
               {"issued_vertices", "issued", 0},
               {"isolated_triangles", "isolated", 0},
               {"issued_per_vertex", "N/n", 2},
               {"by_count", "(f+2F)/n", 2},
               {"rms_thousandths", "RMS e-3", 3}});
  for (std::size_t i = 0; i < subjects.size(); ++i) {
    if (subjects[i].printed != nullptr) add_printed(*subjects[i].printed, table);
    add_levels(subjects[i].name, "paper's, here", figures[i].single, table);
    add_levels(subjects[i].name, "ours", figures[i].ours, table);
  }
  return {
      "fans_levels",
      "levels (the paper's tables 1 to 4). Paper's, here: converted to fans once (section 3.2; candidates by "
      "ascending number, an order that the paper leaves open), merged by E_dist + E_spring, X the vertices, until "
      "nothing can be merged; fans persist. Ours: the builder's generations, covered afresh at each level as the "
      "client draws it: FM0, two levels above it, then at the numbers of vertices of the paper's scheme. A fan of f "
      "faces issues f + 2 vertices; the N that the paper prints for its coarsest and middle levels is above f + 2F by "
      "its isolated triangles and the level's number. RMS: distance from the input, both ways, in thousandths of the "
      "diagonal",
      std::move(table)};
}

Section summary_section(const std::vector<Subject>& subjects, const std::vector<Figures>& figures) {
  Table table({{"mesh", "", 0},
               {"vertices", "", 0},
               {"printed_removed_percent", "removed %: printed", 1},
               {"single_removed_percent", "paper's, here", 1},
               {"our_removed_percent", "ours", 1},
               {"single_rms_thousandths", "RMS e-3 there: paper's", 3},
               {"our_rms_thousandths", "ours ", 3},
               {"rms_ratio", "ours / paper's", 2},
               {"levels", "our levels", 0},
               {"levels_above", "above 2.75", 0},
               {"worst_issued_per_vertex", "worst N/n", 3},
               {"worst_vertices", "at", 0},
               {"worst_bound", "not below", 3}});
  for (std::size_t i = 0; i < subjects.size(); ++i) {
    const Figures& f = figures[i];
    const auto full = static_cast<double>(subjects[i].mesh.positions.size());
    const auto removed = [&](double coarsest) { return percent(1.0 - coarsest / full); };
    const Level& single = f.single.front();
    const Level& ours = f.ours[f.ours_coarser];
    Cell printed;
    if (subjects[i].printed != nullptr) printed = removed(subjects[i].printed->levels[0].vertices);
    const Cell ratio = single.rms > 0.0 ? Cell(ours.rms / single.rms) : Cell();
    table.add_row({subjects[i].name, whole(subjects[i].mesh.positions.size()), printed,
                   removed(static_cast<double>(single.statistics.vertices)),
                   removed(static_cast<double>(f.ours.front().statistics.vertices)), 1e3 * single.rms, 1e3 * ours.rms,
                   ratio, whole(f.worst.levels), whole(f.worst.above), f.worst.issued_per_vertex,
                   whole(f.worst.vertices), f.worst.least});
  }
  return {
      "fans_summary",
      "share of the vertices that merging removes; RMS where the paper's scheme ends, ours at as many vertices; the "
      "largest N/n of our levels, where, and a bound that no cover of that level is below: the fewest vertices that "
      "all "
      "faces have one of, found exactly where the mesh is narrow enough, else from valences alone",
      std::move(table)};
}

Section limits_section(const std::vector<Subject>& subjects, const std::vector<Figures>& figures) {
  Limits limits;
  for (std::size_t i = 0; i < subjects.size(); ++i) {
    const std::string& name = subjects[i].name;
    double worst = 0.0;
    for (const Level& level : figures[i].ours) worst = std::max(worst, level.statistics.issued_per_vertex());
    const auto add = [&](const std::string& figure, double value) {
      if (subjects[i].is_limited) return limits.at_most(figure, name, value, kMostIssuedPerVertex);
      limits.measured(figure, name, value);
    };
    add("issued vertices per vertex, at our levels of the table", worst);
    add("issued vertices per vertex, at any number of vertices", figures[i].worst.issued_per_vertex);
  }
  return {"fans_limits", "figures and limits", limits.take()};
}

Result<void> draw(const Subject& subject, const Figures& figures, const PapersOptions& options) {
  if (subject.picture.empty()) return {};
  options.progress(subject.name + ": " + subject.picture);
  FanSheet sheet{subject.name, {}, 3, subject.seen_from};
  const auto add = [&](const char* scheme, const Level& level) {
    const FanStatistics& s = level.statistics;
    sheet.pictures.push_back(
        {level.fans,
         {fmt::format("{}: {} vertices, {} triangles", scheme, s.vertices, s.faces),
          fmt::format("{} fans, {} isolated triangles (red)", s.fans, s.isolated_triangles),
          fmt::format("{} issued vertices, {:.2f} per vertex", s.issued_vertices, s.issued_per_vertex())}});
  };
  const std::size_t coarser = figures.ours_coarser;
  for (std::size_t i = 0; i < coarser; ++i) add("ours", figures.ours[i]);
  for (const Level& level : figures.single) add("paper's", level);
  for (std::size_t i = coarser; i < figures.ours.size(); ++i) add("ours", figures.ours[i]);
  sheet.columns = 3;
  return draw_fan_sheet(sheet, options.pictures / subject.picture);
}

Result<std::vector<Subject>> make_subjects(const PapersOptions& options) {
  std::vector<Subject> subjects;
  subjects.push_back(
      {"ellipsoid, 20 rings of 20", make_ring_ellipsoid(), &kEllipsoid, "fans_ellipsoid.png", {0.5, 0.4, 1.0}, true});
  subjects.push_back({"ellipsoid, octahedral", make_octahedral_ellipsoid()});
  options.progress("armadillo to 3,522 and 711 vertices");
  const Result<TriangleMesh> armadillo = papers_mesh(options, "armadillo_86k.ply");
  if (!armadillo) return tl::unexpected(armadillo.error());
  for (const auto& [count, printed] : {std::pair(711U, &kVenus), std::pair(3522U, &kPig)}) {
    Result<std::unique_ptr<OurLevels>> reduced = OurLevels::build(*armadillo, count);
    if (!reduced) return tl::unexpected(with_context(reduced.error(), "armadillo_86k.ply"));
    subjects.push_back({fmt::format("armadillo, {}", count),
                        (*reduced)->level(count),
                        printed,
                        fmt::format("fans_{}.png", count),
                        {0.4, 0.3, 1.0},
                        false});
  }
  return subjects;
}

}  // namespace

Result<std::vector<Section>> measure_fans(const PapersOptions& given) {
  PapersOptions options = given;
  if (!options.progress) options.progress = [](std::string_view) {};
  const Result<std::vector<Subject>> subjects = make_subjects(options);
  if (!subjects) return tl::unexpected(subjects.error());
  std::vector<Figures> figures;
  for (const Subject& subject : *subjects) {
    Result<Figures> measured = Measurement(subject, options).run();
    if (!measured) return tl::unexpected(with_context(measured.error(), subject.name));
    if (Result<void> drawn = draw(subject, *measured, options); !drawn) return tl::unexpected(drawn.error());
    figures.push_back(std::move(*measured));
  }
  std::vector<Section> sections;
  sections.push_back(levels_section(*subjects, figures));
  sections.push_back(summary_section(*subjects, figures));
  sections.push_back(limits_section(*subjects, figures));
  return sections;
}

}  // namespace fanstream::bench
