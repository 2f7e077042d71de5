#include "tests/bench/papers/subdivision_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>

#include "client/render/contact_sheet.h"
#include "client/render/offscreen_renderer.h"
#include "client/subdivide/view_subdivision.h"
#include "common/fans/fan_shape.h"
#include "tests/bench/papers/face_picture.h"
#include "tests/bench/papers/papers_report.h"
#include "tests/bench/thread_clock.h"
#include "tests/peers/opensubdiv_peer.h"

namespace fanstream::bench {
namespace {

constexpr std::uint32_t kCoverageScale = 8;
constexpr unsigned kReferenceDepth = 10;

struct Model {
  std::string name;
  PolygonMesh mesh;
  glm::dvec3 from{0.5, 0.4, 1.0};       // the view that is refined for
  glm::dvec3 oblique{1.0, 0.5, -0.35};  // and the one that shows what was not
};

void tell(const PapersOptions& options, std::string_view stage) {
  if (options.progress) options.progress(stage);
}

// A knot of quads around the curve of a trefoil: closed, curved everywhere, with parts that hide others.
PolygonMesh quad_knot(unsigned rings, unsigned sides) {
  using std::numbers::pi;
  const auto curve = [](double t) {
    return glm::dvec3(std::sin(t) + 2 * std::sin(2 * t), std::cos(t) - 2 * std::cos(2 * t), -std::sin(3 * t));
  };
  PolygonMesh mesh;
  for (unsigned i = 0; i < rings; ++i) {
    const double t = 2 * pi * i / rings;
    const glm::dvec3 along = glm::normalize(curve(t + 1e-3) - curve(t - 1e-3));
    const glm::dvec3 side = glm::normalize(glm::cross(along, glm::dvec3(0, 0, 1)));
    const glm::dvec3 up = glm::cross(side, along);
    for (unsigned j = 0; j < sides; ++j) {
      const double a = 2 * pi * j / sides;
      mesh.points.emplace_back(curve(t) + 0.55 * (std::cos(a) * side + std::sin(a) * up), 1.0);
    }
  }
  const auto at = [&](unsigned i, unsigned j) { return (i % rings) * sides + j % sides; };
  for (unsigned i = 0; i < rings; ++i) {
    for (unsigned j = 0; j < sides; ++j) {
      mesh.add_face(std::array<VertexId, 4>{at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return mesh;
}

// Neighbouring triangles made one quad where that is flat and nearest to square: a mesh of quads and triangles, as
// modellers leave it, of one that a file has as triangles.
PolygonMesh with_quads(const TriangleMesh& mesh) {
  struct Pair {
    double badness;
    FaceId f, g;
    std::array<VertexId, 4> quad;
  };
  std::vector<std::pair<std::pair<VertexId, VertexId>, std::uint32_t>> edges;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::uint32_t i = 0; i < 3; ++i) {
      edges.push_back({std::minmax({mesh.triangles[t][i], mesh.triangles[t][(i + 1) % 3]}), 3 * t + i});
    }
  }
  std::sort(edges.begin(), edges.end());
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
    if (edges[i].first != edges[i + 1].first) continue;
    const Triangle& t = mesh.triangles[edges[i].second / 3];
    const Triangle& u = mesh.triangles[edges[i + 1].second / 3];
    const unsigned k = edges[i].second % 3;
    const std::array<VertexId, 4> quad = {t[(k + 1) % 3], t[(k + 2) % 3], t[k], u[(edges[i + 1].second % 3 + 2) % 3]};
    double badness = 0.0;
    for (std::size_t c = 0; c < 4; ++c) {
      const glm::dvec3 to = glm::normalize(mesh.positions[quad[(c + 1) % 4]] - mesh.positions[quad[c]]);
      const glm::dvec3 back = glm::normalize(mesh.positions[quad[(c + 3) % 4]] - mesh.positions[quad[c]]);
      badness = std::max(badness, std::abs(glm::dot(to, back)));
    }
    if (badness < 0.75) pairs.push_back({badness, edges[i].second / 3, edges[i + 1].second / 3, quad});
  }
  std::stable_sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) { return a.badness < b.badness; });
  PolygonMesh result;
  for (const glm::dvec3& place : mesh.positions) result.points.emplace_back(place, 1.0);
  std::vector<std::uint8_t> used(mesh.triangles.size(), 0);
  for (const Pair& pair : pairs) {
    if (used[pair.f] != 0 || used[pair.g] != 0) continue;
    used[pair.f] = used[pair.g] = 1;
    result.add_face(pair.quad);
  }
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (used[t] == 0) result.add_face(mesh.triangles[t]);
  }
  return result;
}

Result<std::vector<Model>> read_models(const PapersOptions& options) {
  std::vector<Model> models;
  models.push_back({"knot of quads", quad_knot(40, 10), {0.3, 0.2, 1.0}, {1.0, 0.25, -0.25}});
  const Result<TriangleMesh> cow = papers_mesh(options, "cow_2904v.off");
  if (!cow) return tl::unexpected(cow.error());
  models.push_back({"cow, quads and triangles", with_quads(*cow), {0.5, 0.25, 1.0}, {1.0, 0.3, -0.3}});
  const Result<TriangleMesh> spot = papers_mesh(options, "spot_textured.glb");
  if (!spot) return tl::unexpected(spot.error());
  models.push_back({"spot, triangles", polygon_mesh(*spot), {0.6, 0.3, -1.0}, {1.0, 0.4, 0.4}});
  for (const Model& model : models) {
    if (auto checked = check_polygons(model.mesh); !checked) {
      return tl::unexpected(with_context(checked.error(), model.name));
    }
  }
  return models;
}

View view_of(const PolygonMesh& mesh, const glm::dvec3& from, std::uint32_t width, std::uint32_t height) {
  FitOptions options;
  options.from = from;
  options.aspect = static_cast<double>(width) / height;
  View view;
  view.camera = fit(positions(mesh.points), options);
  view.width_px = width;
  view.height_px = height;
  return view;
}

std::string faces_text(const PolygonMesh& mesh) {
  std::array<std::size_t, 3> by_size{};
  for (FaceId f = 0; f < mesh.face_count(); ++f) ++by_size[std::min<std::size_t>(mesh.face(f).size(), 5) - 3];
  return fmt::format("{} triangles, {} quads, {} larger", by_size[0], by_size[1], by_size[2]);
}

// ---- speed

struct SpeedInput {
  std::string name;
  PolygonMesh mesh;
  unsigned levels;
};

Result<Section> measure_speed(const PapersOptions& options, const std::vector<Model>& models) {
  std::vector<SpeedInput> inputs;
  inputs.push_back({models[0].name, models[0].mesh, 6});
  inputs.push_back({models[1].name, models[1].mesh, 4});
  Result<PolygonMesh> fine = subdivide(models[0].mesh, 8);
  if (!fine) return tl::unexpected(fine.error());
  inputs.push_back({"knot of quads, 102,400 of them", std::move(*fine), 2});
  Table table({{"input", "", 0},
               {"faces", "faces of the input", 0},
               {"levels", "Catmull-Clark levels", 0},
               {"output_faces", "faces of the result", 0},
               {"ours_ms", "ours, 4 doubles (ms)", 1},
               {"opensubdiv_double_ms", "OpenSubdiv, 4 doubles (ms)", 1},
               {"opensubdiv_float_ms", "OpenSubdiv, 3 floats (ms)", 1},
               {"ratio_double", "OpenSubdiv / ours, 4 doubles", 2},
               {"ratio_float", "OpenSubdiv, 3 floats / ours", 2}});
  for (const SpeedInput& input : inputs) {
    tell(options, "subdivision: speed, " + input.name);
    std::array<double, 3> best_s;
    best_s.fill(std::numeric_limits<double>::infinity());
    std::size_t faces = 0;
    const auto time = [](double& best, auto work) {
      const double begin = thread_cpu_seconds();
      work();
      best = std::min(best, thread_cpu_seconds() - begin);
    };
    for (int round = 0; round < (options.quick ? 3 : 9); ++round) {
      time(best_s[0], [&] { faces = subdivide(input.mesh, 2 * input.levels).value().face_count(); });
      time(best_s[1], [&] { testing::time_opensubdiv(input.mesh, input.levels, true); });
      time(best_s[2], [&] { testing::time_opensubdiv(input.mesh, input.levels, false); });
    }
    table.add_row({input.name, whole(input.mesh.face_count()), whole(input.levels), whole(faces), 1e3 * best_s[0],
                   1e3 * best_s[1], 1e3 * best_s[2], best_s[1] / best_s[0], best_s[2] / best_s[0]});
  }
  return Section{"subdivision_speed",
                 "sqrt(2)-subdivision: time of uniform refinement, topology and points, one thread, CPU time, least of "
                 "several in turns (at least as fast as OpenSubdiv: ratios of 1 or more)",
                 std::move(table)};
}

// ---- faces at the same outline

Result<AdaptiveMesh> refine_for(const Model& model, const View& view, unsigned depth, double size_px = 0.0,
                                double tolerance_px = 0.0) {
  ViewSubdivisionOptions options;
  options.front_depth = std::min(depth, 4U);
  options.silhouette_depth = depth;
  options.size_px = size_px;
  options.tolerance_px = tolerance_px;
  Result<ViewSubdivision> refined = subdivide_for_view(model.mesh, view, options);
  if (!refined) return tl::unexpected(with_context(refined.error(), model.name));
  return std::move(refined->refined);
}

Result<void> add_outline_rows(const PapersOptions& options, const Model& model, Table& table) {
  const View view = view_of(model.mesh, model.from, 1024, 768);
  const Result<PolygonMesh> limit = subdivide(model.mesh, kReferenceDepth);
  if (!limit) return tl::unexpected(limit.error());
  const Coverage right = cover(*limit, view, kCoverageScale);
  for (const unsigned depth : {0U, 2U, 4U, 6U, 8U}) {
    tell(options, fmt::format("subdivision: outline, {}, depth {}", model.name, depth));
    const Result<PolygonMesh> uniform = subdivide(model.mesh, depth);
    if (!uniform) return tl::unexpected(uniform.error());
    const Result<AdaptiveMesh> adaptive = refine_for(model, view, depth);
    if (!adaptive) return tl::unexpected(adaptive.error());
    const Result<AdaptiveMesh> stopped = refine_for(model, view, depth, 0.0, 0.05);
    if (!stopped) return tl::unexpected(stopped.error());
    const OutlineError of_uniform = outline_error(cover(*uniform, view, kCoverageScale), right);
    const OutlineError of_adaptive = outline_error(cover(adaptive->mesh, view, kCoverageScale), right);
    table.add_row({model.name, whole(depth), whole(uniform->face_count()), whole(adaptive->mesh.face_count()),
                   static_cast<double>(uniform->face_count()) / static_cast<double>(adaptive->mesh.face_count()),
                   whole(stopped->mesh.face_count()),
                   outline_error(cover(stopped->mesh, view, kCoverageScale), right).mean_px, of_uniform.mean_px,
                   of_adaptive.mean_px, of_uniform.max_px, of_adaptive.max_px});
  }
  return {};
}

Result<Section> measure_outlines(const PapersOptions& options, const std::vector<Model>& models) {
  Table table({{"model", "", 0},
               {"depth", "half-steps at the silhouette", 0},
               {"uniform_faces", "faces, uniform", 0},
               {"adaptive_faces", "faces, adaptive", 0},
               {"ratio", "uniform / adaptive", 2},
               {"stopped_faces", "faces, adaptive, stopped at 0.05 px", 0},
               {"stopped_mean_px", "outline off, mean (px), stopped", 3},
               {"uniform_mean_px", "outline off, mean (px), uniform", 3},
               {"adaptive_mean_px", "adaptive", 3},
               {"uniform_max_px", "outline off, most (px), uniform", 2},
               {"adaptive_max_px", "adaptive", 2}});
  for (const Model& model : models) {
    if (auto done = add_outline_rows(options, model, table); !done) return tl::unexpected(done.error());
  }
  return Section{
      "subdivision_outline",
      fmt::format(
          "sqrt(2)-subdivision for a view of 1024 x 768, front faces to depth 4 at most, silhouettes to the depth "
          "given, whatever their size on the screen; 'stopped': faces within about 0.05 px of the "
          "limit surface were left alone; error of the outline against uniform depth {}, by samples "
          "of 1/{} px (source: depths 4 and 8, no figures)",
          kReferenceDepth, kCoverageScale),
      std::move(table)};
}

// ---- pictures

Result<Image> shaded(const PolygonMesh& mesh, const View& view) {
  const Result<FanMesh> fans = make_fan_mesh(triangle_mesh(mesh), CoverMethod::greedy);
  if (!fans) return tl::unexpected(fans.error());
  Result<OffscreenRenderer> renderer = OffscreenRenderer::create(view.width_px, view.height_px);
  if (!renderer) return tl::unexpected(renderer.error());
  return renderer->render(*fans, view.camera);
}

Result<void> write_picture(const PapersOptions& options, const Model& model) {
  tell(options, "subdivision: picture, " + model.name);
  const View front = view_of(model.mesh, model.from, 720, 600);
  const View oblique = view_of(model.mesh, model.oblique, 720, 600);
  const Result<AdaptiveMesh> refined = refine_for(model, front, 8, 1.0);
  if (!refined) return tl::unexpected(refined.error());
  std::vector<ContactSheetEntry> entries;
  const std::string count = fmt::format("{} faces", refined->mesh.face_count());
  const std::vector<std::uint8_t> coarse(model.mesh.face_count(), 0);
  entries.push_back({draw_faces(model.mesh, coarse, front), {"Initial mesh", faces_text(model.mesh)}});
  Result<Image> before = shaded(model.mesh, front);
  if (!before) return tl::unexpected(before.error());
  entries.push_back({std::move(*before), {"Initial mesh, shaded", "smooth normals do not help the outline"}});
  Result<Image> after = shaded(refined->mesh, front);
  if (!after) return tl::unexpected(after.error());
  entries.push_back({std::move(*after), {"Refined for this view", count}});
  entries.push_back({draw_faces(refined->mesh, refined->face_depths, front),
                     {"Its faces", "depth 4 green, silhouettes 6 yellow, 8 red"}});
  entries.push_back({draw_faces(refined->mesh, refined->face_depths, oblique),
                     {"The same mesh, seen obliquely", "back faces stay as they were (grey; depth 2 blue)"}});
  Result<Image> behind = shaded(refined->mesh, oblique);
  if (!behind) return tl::unexpected(behind.error());
  entries.push_back({std::move(*behind), {"Obliquely, shaded", "coarse where the view does not reach"}});
  ContactSheetOptions sheet;
  sheet.title = "sqrt(2)-subdivision for a view: " + model.name;
  sheet.columns = 3;
  const Result<Image> image = make_contact_sheet(entries, sheet);
  if (!image) return tl::unexpected(image.error());
  std::string file = model.name.substr(0, model.name.find_first_of(" ,"));
  return write_png(*image, options.pictures / ("subdivision-" + file + ".png"));
}

}  // namespace

Result<std::vector<Section>> measure_subdivision(const PapersOptions& options) {
  const Result<std::vector<Model>> models = read_models(options);
  if (!models) return tl::unexpected(models.error());
  std::vector<Section> sections;
  Result<Section> speed = measure_speed(options, *models);
  if (!speed) return tl::unexpected(speed.error());
  sections.push_back(std::move(*speed));
  Result<Section> outlines = measure_outlines(options, *models);
  if (!outlines) return tl::unexpected(outlines.error());
  sections.push_back(std::move(*outlines));
  for (const Model& model : *models) {
    if (auto written = write_picture(options, model); !written) return tl::unexpected(written.error());
  }
  return sections;
}

}  // namespace fanstream::bench
