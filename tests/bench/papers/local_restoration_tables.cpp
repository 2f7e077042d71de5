#include "tests/bench/papers/local_restoration_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <glm/geometric.hpp>
#include <span>

#include "client/render/contact_sheet.h"
#include "client/render/offscreen_renderer.h"
#include "client/render/plot.h"
#include "common/fans/fan_shape.h"
#include "tests/bench/papers/local_restoration_measure.h"
#include "tests/bench/papers/papers_report.h"

namespace fanstream::bench {
namespace {

constexpr std::uint32_t kModelTriangles = 4512;  // the source's
constexpr double kRadius = 0.02;                 // of the focus, by the diagonal, at the smallest size

void tell(const PapersOptions& options, const std::string& stage) {
  if (options.progress) options.progress("local restoration: " + stage);
}

// --- Drawing ---

double process_cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct DrawingFigures {
  double ms_restored = 0.0, ms_full = 0.0;            // drawing
  double ms_both_restored = 0.0, ms_both_full = 0.0;  // and colliding
};

Result<DrawingFigures> measure_drawing(const CollisionSubject& subject, const ContactPath& path, int rounds) {
  Result<OffscreenRenderer> renderer = OffscreenRenderer::create(640, 480);
  if (!renderer) return tl::unexpected(renderer.error());
  const Camera camera = fit(subject.full.positions);
  const Result<FanMesh> full = make_fan_mesh(subject.full, CoverMethod::greedy);
  if (!full) return tl::unexpected(full.error());
  PlaneContacts found;
  const auto draw = [&](const ContactFrame& frame, bool restored, bool colliding) -> Result<double> {
    const double start = process_cpu_seconds();
    FanMesh fans;
    if (restored) {
      subject.local->move(frame.focus);
      Result<FanMesh> made = make_fan_mesh(subject.local->surface().triangle_mesh(), CoverMethod::greedy);
      if (!made) return tl::unexpected(made.error());
      fans = std::move(*made);
    }
    if (Result<Image> image = renderer->render(restored ? fans : *full, camera); !image) {
      return tl::unexpected(image.error());
    }
    if (colliding) {
      if (restored) {
        collide(subject.local->surface(), frame.planes, found);
      } else {
        collide(subject.flat, frame.planes, found);
      }
    }
    return 1e3 * (process_cpu_seconds() - start);
  };
  std::array<std::vector<double>, 4> times;
  for (int round = 0; round < rounds; ++round) {
    const ContactFrame& frame = path[static_cast<std::size_t>(round) * path.size() / static_cast<std::size_t>(rounds)];
    for (std::size_t way = 0; way < times.size(); ++way) {
      const Result<double> ms = draw(frame, way % 2 == 0, way >= 2);
      if (!ms) return tl::unexpected(ms.error());
      times[way].push_back(*ms);
    }
  }
  const auto median = [](std::vector<double>& values) {
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    return values[values.size() / 2];
  };
  return DrawingFigures{median(times[0]), median(times[1]), median(times[2]), median(times[3])};
}

Section speed_section(const CollisionFigures& room, const CollisionFigures& one, const DrawingFigures& d) {
  Table table({{"what", "", 0},
               {"source_simplified_fps", "source: restored, fps", 2},
               {"source_full_fps", "source: full, fps", 2},
               {"source_ratio", "ratio", 2},
               {"restored_fps", "ours: restored, fps", 0},
               {"full_fps", "ours: full, fps", 0},
               {"ratio", "ratio", 2}});
  const auto row = [&](const std::string& what, double source, double source_full, double us, double us_full) {
    table.add_row({what, source, source_full, source / source_full, 1e6 / us, 1e6 / us_full, us_full / us});
  };
  const auto more = [&](const std::string& what, double us, double us_full) {
    table.add_row({what, {}, {}, {}, 1e6 / us, 1e6 / us_full, us_full / us});
  };
  row("drawing", 57.92, 52.90, 1e3 * d.ms_restored, 1e3 * d.ms_full);
  row("colliding", 56.30, 30.21, room.us_restored, room.us_full);
  row("both", 49.63, 14.63, 1e3 * d.ms_both_restored, 1e3 * d.ms_both_full);
  more("colliding, every restored triangle tested", room.us_one_by_one, room.us_full);
  more("colliding, the full mesh under the tree too", room.us_restored, room.us_full_tree);
  more("colliding, the focus stands still", room.us_restored - room.us_move, room.us_full);
  more("colliding with one plane only", one.us_restored, one.us_full);
  more("one plane, the focus stands still", one.us_restored - one.us_move, one.us_full);
  return {
      "local_restoration_speed",
      fmt::format(
          "Local restoration: armadillo_86k reduced to {} triangles, in a room of six planes of which one touches it "
          "where the focus is; that goes along the model by a twentieth of its radius a frame. {:.0f} triangles on "
          "average (source: 445), {:.0f} of them original, {:.1f} splits a frame. Colliding: CPU time of one thread, "
          "moving the focus included; full: the signed distances of every polygon to every plane. Drawing: 640 x "
          "480 by OSMesa, CPU time of all its threads, fans made anew each frame",
          kModelTriangles, room.mean_triangles, room.mean_original, room.mean_splits),
      std::move(table)};
}

// --- Growth ---

struct GrowthRow {
  double triangles = 0.0;
  bool fixed_radius = false;
  double radius = 0.0;  // of the diagonal
  CollisionFigures figures;
};

Section growth_section(const std::vector<GrowthRow>& rows) {
  Table table({{"focus", "", 0},
               {"triangles", "model, triangles", 0},
               {"radius_of_diagonal", "radius / diagonal", 4},
               {"mesh_triangles", "mesh, triangles", 0},
               {"original", "original", 0},
               {"splits", "splits a frame", 1},
               {"contacts", "contacts", 1},
               {"tested", "tested", 0},
               {"move_us", "move, us", 2},
               {"collide_us", "collide, us", 2},
               {"frame_us", "both, us", 2},
               {"within", "in focus: contacts", 1},
               {"within_us", "collide, us", 2},
               {"full_tree_us", "full mesh, tree, us", 2},
               {"full_us", "full mesh, us", 1},
               {"ratio", "full / restored", 1},
               {"ball_tested", "ball: tested", 0},
               {"ball_pairs", "pairs", 1},
               {"ball_us", "restored, us", 1},
               {"ball_full_us", "full mesh, us", 1}});
  for (const GrowthRow& r : rows) {
    const CollisionFigures& f = r.figures;
    table.add_row({std::string(r.fixed_radius ? "same radius" : "same triangles"),
                   whole(std::llround(r.triangles)),
                   r.radius,
                   f.mean_triangles,
                   f.mean_original,
                   f.mean_splits,
                   f.mean_contacts,
                   f.mean_tested,
                   f.us_move,
                   f.us_restored - f.us_move,
                   f.us_restored,
                   f.mean_within,
                   f.us_within - f.us_move,
                   f.us_full_tree,
                   f.us_full,
                   f.us_full / f.us_restored,
                   f.mean_ball_tested,
                   f.mean_ball_pairs,
                   f.us_ball,
                   f.us_ball_full});
  }
  return {"local_restoration_growth",
          "Local restoration: time of a frame (the focus moves by a twentieth of its radius; six planes, one of which "
          "touches) as the model grows; dragon_stanford_full reduced; 40 stretches of the path, the same places at "
          "every size. A fixed focus is one that holds as many triangles (same triangles: its radius shrinks as the "
          "model's triangles do); one of the same radius holds as many more as the model has. In focus: only contacts "
          "there are asked for. Ball: contacts with a "
          "mesh of 800 triangles that dips into the surface there, by FCL, the focus standing still",
          std::move(table)};
}

// time = a + b ln(triangles), by least squares.
struct LogFit {
  double a = 0.0, b = 0.0;
  double r_squared = 0.0;
  double at(double triangles) const { return a + b * std::log(triangles); }
};
LogFit fit_log(const std::vector<glm::dvec2>& points) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  for (const glm::dvec2& p : points) {
    const double l = std::log(p.x);
    n += 1;
    x += l;
    y += p.y;
    xx += l * l;
    xy += l * p.y;
    yy += p.y * p.y;
  }
  LogFit fitted;
  fitted.b = (n * xy - x * y) / (n * xx - x * x);
  fitted.a = (y - fitted.b * x) / n;
  const double total = yy - y * y / n;
  double left = 0.0;
  for (const glm::dvec2& p : points) left += std::pow(p.y - fitted.at(p.x), 2);
  fitted.r_squared = total > 0.0 ? 1.0 - left / total : 1.0;
  return fitted;
}

// The power p of time ~ triangles^p between the first and the last.
double power(const std::vector<glm::dvec2>& points) {
  return std::log(points.back().y / points.front().y) / std::log(points.back().x / points.front().x);
}

std::vector<glm::dvec2> curve(const std::vector<GrowthRow>& rows, bool fixed_radius, double CollisionFigures::*value) {
  std::vector<glm::dvec2> points;
  for (const GrowthRow& r : rows) {
    if (r.fixed_radius == fixed_radius) points.emplace_back(r.triangles, r.figures.*value);
  }
  return points;
}

Section limits_section(const CollisionFigures& small, const std::vector<GrowthRow>& rows) {
  Limits limits;
  limits.at_least("colliding, full over restored", "4,512 triangles, six planes", small.us_full / small.us_restored,
                  3.0);
  const std::vector<glm::dvec2> points = curve(rows, false, &CollisionFigures::us_restored);
  const std::string range = fmt::format("{:.0f} K to {:.0f} K", points.front().x / 1e3, points.back().x / 1e3);
  // Faster than the logarithm would be above the line through the smaller sizes; a tenth is noise. Two sizes make no
  // line.
  const double beside_line = points.back().y / fit_log({points.begin(), points.end() - 1}).at(points.back().x);
  const std::string figure = "time at the largest size over a + b ln(triangles), fitted to the smaller ones";
  if (points.size() > 3) {
    limits.at_most(figure, range, beside_line, 1.1);
  } else {
    limits.measured(figure, range, beside_line);
  }
  const LogFit fitted = fit_log(points);
  limits.measured("us more each time the model doubles (fit to the logarithm)", range, fitted.b * std::log(2.0));
  limits.measured("R squared of that fit", range, fitted.r_squared);
  limits.measured("power of the triangles: restored", range, power(points));
  limits.measured("power of the triangles: restored, contacts in focus alone", range,
                  power(curve(rows, false, &CollisionFigures::us_within)));
  limits.measured("power of the triangles: restored, same radius", range,
                  power(curve(rows, true, &CollisionFigures::us_restored)));
  limits.measured("power of the triangles: full mesh under the tree", range,
                  power(curve(rows, false, &CollisionFigures::us_full_tree)));
  limits.measured("power of the triangles: full mesh", range, power(curve(rows, false, &CollisionFigures::us_full)));
  return {"local_restoration_limits", "Local restoration: figures to reach", limits.take()};
}

Result<void> draw_plots(const std::vector<GrowthRow>& rows, const std::filesystem::path& folder) {
  const std::vector<glm::dvec2> points = curve(rows, false, &CollisionFigures::us_restored);
  const LogFit fitted = fit_log(points);
  PlotSeries fit_line{"a + b ln(triangles)", {}, false, true};
  for (double t = points.front().x; t <= points.back().x * 1.001; t *= 1.1)
    fit_line.points.emplace_back(t, fitted.at(t));
  PlotOptions options;
  options.title = "A frame of local restoration and collision, as the model grows";
  options.x = {"triangles of the model", true};
  options.y = {"CPU time a frame, us"};
  Result<Image> plot = draw_plot({{"focus and collision", points},
                                  {"of that, collision",
                                   [&] {
                                     std::vector<glm::dvec2> less = points;
                                     const auto moves = curve(rows, false, &CollisionFigures::us_move);
                                     for (std::size_t i = 0; i < less.size(); ++i) less[i].y -= moves[i].y;
                                     return less;
                                   }()},
                                  fit_line},
                                 options);
  if (!plot) return tl::unexpected(plot.error());
  if (auto written = write_png(*plot, folder / "local_restoration_growth.png"); !written) return written;
  options.title = "The same beside the full mesh";
  options.y.logarithmic = true;
  plot = draw_plot({{"full mesh, every triangle", curve(rows, false, &CollisionFigures::us_full)},
                    {"full mesh under the tree", curve(rows, false, &CollisionFigures::us_full_tree)},
                    {"restored, same radius", curve(rows, true, &CollisionFigures::us_restored)},
                    {"restored, same triangles in focus", points}},
                   options);
  if (!plot) return tl::unexpected(plot.error());
  return write_png(*plot, folder / "local_restoration_beside_full.png");
}

Result<std::vector<GrowthRow>> measure_growth(const PapersOptions& options) {
  tell(options, "reducing the dragon");
  const Result<TriangleMesh> dragon = papers_mesh(options, "dragon_stanford_full.ply");
  if (!dragon) return tl::unexpected(dragon.error());
  std::vector<std::uint32_t> sizes{5'000, 20'000, 80'000, 300'000, 1'000'000};
  if (options.quick) sizes.resize(3);
  Result<std::vector<TriangleMesh>> meshes = reduced_meshes(*dragon, sizes);
  if (!meshes) return tl::unexpected(meshes.error());
  std::vector<GrowthRow> rows;
  double first_radius = 0.0;
  for (TriangleMesh& mesh : *meshes) {
    tell(options, fmt::format("dragon of {} triangles", mesh.triangles.size()));
    Result<CollisionSubject> subject = make_subject(mesh);
    if (!subject) return tl::unexpected(subject.error());
    mesh = {};
    const auto triangles = static_cast<double>(subject->full.triangles.size());
    if (rows.empty()) first_radius = kRadius * subject->diagonal;
    const double first_triangles = rows.empty() ? triangles : rows.front().triangles;
    for (const bool fixed_radius : {false, true}) {
      const double radius = fixed_radius ? first_radius : first_radius * std::sqrt(first_triangles / triangles);
      const Result<std::vector<ContactPath>> stretches =
          contact_stretches(subject->full, radius, 40, fixed_radius ? 5 : 25);
      if (!stretches) return tl::unexpected(stretches.error());
      const CollisionFigures figures = measure_collision(*subject, *stretches, 6, options.quick ? 2 : 5);
      rows.push_back({triangles, fixed_radius, radius / subject->diagonal, figures});
    }
  }
  return rows;
}

// --- The picture ---

// What is original in blue.
Result<Image> draw_restored(OffscreenRenderer& renderer, const LiveSurface& surface, const Camera& camera) {
  std::vector<bool> original;
  const FanMesh fans = make_triangle_fans(surface.triangle_mesh(&original));
  RenderOptions look;
  look.shading = Shading::flat;
  for (const bool is_original : original) {
    look.fan_colors.push_back(is_original ? glm::vec3(0.42F, 0.60F, 0.85F) : look.color);
  }
  return renderer.render(fans, camera, look);
}

Result<void> draw_picture(const CollisionSubject& subject, const std::filesystem::path& file) {
  Result<OffscreenRenderer> renderer = OffscreenRenderer::create(640, 720);
  if (!renderer) return tl::unexpected(renderer.error());
  FitOptions whole;
  whole.aspect = 640.0 / 720.0;
  const Camera camera = fit(subject.full.positions, whole);
  const Result<ContactPath> path = contact_path(subject.full, 0.05 * subject.diagonal, 5000);
  if (!path) return tl::unexpected(path.error());
  std::vector<ContactSheetEntry> entries;
  const auto add = [&](const LiveSurface& surface, const std::string& caption) -> Result<void> {
    Result<Image> image = draw_restored(*renderer, surface, camera);
    if (!image) return tl::unexpected(image.error());
    entries.push_back({std::move(*image), {caption, fmt::format("{} triangles", surface.triangle_count())}});
    return {};
  };
  if (auto added = add(subject.refined->surface(), "The model, all of it original"); !added) return added;
  // Two places of contact that the camera sees.
  std::vector<const ContactFrame*> seen;
  for (const ContactFrame& f : *path) {
    if (glm::dot(f.planes[0].normal, glm::normalize(camera.eye - f.focus.sphere->centre)) < -0.6) seen.push_back(&f);
  }
  if (seen.empty()) seen.push_back(&path->front());
  for (const ContactFrame* f : {seen[seen.size() / 8], seen[7 * seen.size() / 8]}) {
    subject.local->move(f->focus);
    if (auto added = add(subject.local->surface(), "Restored within 5 % of the diagonal"); !added) return added;
  }
  ContactSheetOptions sheet;
  sheet.title =
      "Local restoration: original (blue) in the focus and where that needs it, simplified elsewhere, one mesh";
  sheet.columns = 3;
  const Result<Image> picture = make_contact_sheet(entries, sheet);
  if (!picture) return tl::unexpected(picture.error());
  return write_png(*picture, file);
}

}  // namespace

Result<std::vector<Section>> measure_local_restoration(const PapersOptions& options) {
  tell(options, "reducing the armadillo");
  const Result<TriangleMesh> armadillo = papers_mesh(options, "armadillo_86k.ply");
  if (!armadillo) return tl::unexpected(armadillo.error());
  const Result<std::vector<TriangleMesh>> reduced = reduced_meshes(*armadillo, {kModelTriangles});
  if (!reduced) return tl::unexpected(with_context(reduced.error(), "armadillo_86k.ply"));
  const Result<CollisionSubject> subject = make_subject(reduced->front());
  if (!subject) return tl::unexpected(subject.error());
  tell(options, "colliding and drawing");
  const double radius = kRadius * subject->diagonal;
  const Result<ContactPath> path = contact_path(subject->full, radius, 5000);
  const Result<std::vector<ContactPath>> stretches = contact_stretches(subject->full, radius, 40, 50);
  if (!path) return tl::unexpected(path.error());
  if (!stretches) return tl::unexpected(stretches.error());
  const CollisionFigures room = measure_collision(*subject, *stretches, 6, options.quick ? 3 : 15);
  const CollisionFigures one = measure_collision(*subject, *stretches, 1, options.quick ? 3 : 15);
  const Result<DrawingFigures> drawing = measure_drawing(*subject, *path, options.quick ? 15 : 60);
  if (!drawing) return tl::unexpected(drawing.error());
  if (auto drawn = draw_picture(*subject, options.pictures / "local_restoration.png"); !drawn) {
    return tl::unexpected(drawn.error());
  }
  const Result<std::vector<GrowthRow>> growth = measure_growth(options);
  if (!growth) return tl::unexpected(growth.error());
  if (auto drawn = draw_plots(*growth, options.pictures); !drawn) return tl::unexpected(drawn.error());
  std::vector<Section> sections;
  sections.push_back(speed_section(room, one, *drawing));
  sections.push_back(growth_section(*growth));
  sections.push_back(limits_section(room, *growth));
  return sections;
}

}  // namespace fanstream::bench
