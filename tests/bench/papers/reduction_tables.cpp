#include "tests/bench/papers/reduction_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>

#include "client/reduce/mesh_reduction.h"
#include "client/render/contact_sheet.h"
#include "client/render/offscreen_renderer.h"
#include "common/fans/fan_shape.h"
#include "common/geometry/mesh_distance.h"
#include "common/import/attribute_transfer.h"
#include "common/import/mesh_cleaner.h"
#include "common/import/mesh_import.h"
#include "tests/bench/meshoptimizer_peer.h"
#include "tests/bench/thread_clock.h"

namespace fanstream::bench {

namespace {

constexpr std::array<std::size_t, 4> kCounts{4000, 2000, 1000, 200};  // of the source's picture
constexpr const char* kPictured = "stanford_bunny_zipper.ply";
constexpr const char* kTextured = "spot_textured.glb";
constexpr std::array<const char*, 7> kModels{kPictured,
                                             "armadillo_86k.ply",
                                             "skull_100k_genus2.ply",
                                             "mountain_terrain_51k_open.ply",
                                             "fandisk_13k.obj",
                                             "cow_2904v.off",
                                             kTextured};

struct Model {
  std::string name;
  TriangleMesh mesh;
  CornerAttributes attributes;
};

Result<Model> read_model(const PapersOptions& options, const char* file) {
  ImportOptions import;
  import.keep_attributes = true;
  Result<ImportedMesh> imported = import_mesh(options.models / file, import);
  if (!imported) return tl::unexpected(imported.error());
  Model model{std::filesystem::path(file).stem().string(), clean_mesh(imported->mesh).mesh, {}};
  if (model.mesh.triangles.empty()) return fail(ErrorKind::bad_input, std::string(file) + ": no triangles are left");
  model.attributes = attributes_after_cleaning(imported->mesh, std::move(imported->attributes), model.mesh);
  return model;
}

Result<std::vector<ReducedLevel>> reduce(const Model& model, const ReductionOptions& options) {
  std::vector<ReducedLevel> levels;
  const auto reduced = reduce_mesh(model.mesh, model.attributes, kCounts, options, [&](ReducedLevel&& level) {
    levels.push_back(std::move(level));
    return Result<void>();
  });
  if (!reduced) return tl::unexpected(with_context(reduced.error(), model.name));
  return levels;
}

struct Figures {
  std::vector<ReducedLevel> ours;
  std::vector<SimplifyResult> peer;
  double ours_s = std::numeric_limits<double>::infinity();  // all counts in one pass
  double peer_s = std::numeric_limits<double>::infinity();  // all counts, one call each, from the model
};

// Ours and the peer in turn, each the least of the repetitions.
Result<Figures> run_both(const Model& model, int repetitions) {
  Figures figures;
  for (int i = 0; i < repetitions; ++i) {
    double start = thread_cpu_seconds();
    Result<std::vector<ReducedLevel>> ours = reduce(model, {});
    if (!ours) return tl::unexpected(ours.error());
    figures.ours_s = std::min(figures.ours_s, thread_cpu_seconds() - start);
    figures.ours = std::move(*ours);
    figures.peer.clear();
    start = thread_cpu_seconds();
    for (const ReducedLevel& level : figures.ours) {
      Result<SimplifyResult> peer = simplify_with_meshoptimizer(model.mesh, {level.mesh.triangles.size(), false});
      if (!peer) return tl::unexpected(with_context(peer.error(), model.name));
      figures.peer.push_back(std::move(*peer));
    }
    figures.peer_s = std::min(figures.peer_s, thread_cpu_seconds() - start);
  }
  return figures;
}

class Measure {
 public:
  Measure(const Model& model, const TriangleTree& tree, bool quick) : model_(model), tree_(tree) {
    sampling_.face_samples = quick ? 30'000 : 200'000;
  }
  Result<MeshDistance> operator()(const TriangleMesh& mesh) const {
    return mesh_distance(model_.mesh, tree_, mesh, sampling_);
  }

 private:
  const Model& model_;
  const TriangleTree& tree_;
  DistanceOptions sampling_;
};

Table level_table() {
  return Table({{"model", "", 0},
                {"asked", "", 0},
                {"triangles", "", 0},
                {"vertices", "", 0},
                {"rms_percent", "rms %", 4},
                {"max_percent", "max %", 3},
                {"peer_triangles", "meshopt", 0},
                {"peer_rms_percent", "rms %", 4},
                {"peer_max_percent", "max %", 3},
                {"rms_ratio", "rms / meshopt", 3},
                {"short", "", 0}});
}

Result<void> add_levels(const Model& model, const Figures& figures, const Measure& measure, Table& table) {
  for (std::size_t i = 0; i < figures.ours.size(); ++i) {
    const ReducedLevel& level = figures.ours[i];
    const Result<MeshDistance> ours = measure(level.mesh);
    if (!ours) return tl::unexpected(ours.error());
    const Result<MeshDistance> peer = measure(figures.peer[i].mesh);
    if (!peer) return tl::unexpected(peer.error());
    table.add_row({model.name, whole(level.asked_triangles), whole(level.mesh.triangles.size()),
                   whole(level.mesh.positions.size()), percent(ours->relative_rms()), percent(ours->relative_max()),
                   whole(figures.peer[i].mesh.triangles.size()), percent(peer->relative_rms()),
                   percent(peer->relative_max()), ours->relative_rms() / peer->relative_rms(), level.shortfall});
  }
  return {};
}

Table time_table() {
  return Table({{"model", "", 0},
                {"triangles", "", 0},
                {"seconds", "s, one pass", 3},
                {"mtri_per_s", "Mtri/s", 3},
                {"peer_seconds", "meshopt s, four calls", 3},
                {"peer_mtri_per_s", "Mtri/s a call", 3},
                {"texture", "texture coordinates", 0}});
}

void add_time(const Model& model, const Figures& figures, Table& table) {
  const auto triangles = static_cast<double>(model.mesh.triangles.size());
  table.add_row({model.name, whole(model.mesh.triangles.size()), figures.ours_s, 1e-6 * triangles / figures.ours_s,
                 figures.peer_s, 1e-6 * static_cast<double>(kCounts.size()) * triangles / figures.peer_s,
                 std::string(model.attributes.empty() ? "no" : "yes, ours alone keeps them")});
}

Table texture_table() {
  return Table({{"model", "", 0},
                {"triangles", "", 0},
                {"vertices", "", 0},
                {"file_vertices", "vertices in the file", 0},
                {"median_percent", "median %", 3},
                {"p90_percent", "90 of 100 %", 3}});
}

glm::dvec2 at_corners(const CornerAttributes& attributes, std::size_t triangle, const glm::dvec3& weights) {
  glm::dvec2 uv(0.0);
  for (int i = 0; i < 3; ++i) {
    const VertexId wedge = attributes.wedges[triangle][static_cast<std::size_t>(i)];
    uv += weights[i] * attributes.values.texture_coordinates[wedge];
  }
  return uv;
}

// Weights of the corners that give a point of the triangle; thirds where it has no area.
glm::dvec3 weights_of(const TriangleMesh& mesh, std::size_t triangle, const glm::dvec3& point) {
  const glm::dvec3 a = mesh.positions[mesh.triangles[triangle][0]];
  const glm::dvec3 b = mesh.positions[mesh.triangles[triangle][1]] - a;
  const glm::dvec3 c = mesh.positions[mesh.triangles[triangle][2]] - a;
  const glm::dvec3 normal = glm::cross(b, c);
  const double area = glm::dot(normal, normal);
  if (area == 0.0) return glm::dvec3(1.0 / 3.0);
  const double second = glm::dot(glm::cross(point - a, c), normal) / area;
  const double third = glm::dot(glm::cross(b, point - a), normal) / area;
  return {1.0 - second - third, second, third};
}

// How far the texture at the middle of each triangle is from that of the closest point of the model.
void add_texture(const Model& model, const Figures& figures, const TriangleTree& tree, Table& table) {
  for (const ReducedLevel& level : figures.ours) {
    std::vector<double> off;
    for (std::size_t t = 0; t < level.mesh.triangles.size(); ++t) {
      glm::dvec3 middle(0.0);
      for (const VertexId v : level.mesh.triangles[t]) middle += level.mesh.positions[v] / 3.0;
      const SurfacePoint closest = tree.closest(middle);
      const std::uint32_t source = tree.triangle(closest.slot);
      off.push_back(
          glm::distance(at_corners(level.attributes, t, glm::dvec3(1.0 / 3.0)),
                        at_corners(model.attributes, source, weights_of(model.mesh, source, closest.position))));
    }
    std::sort(off.begin(), off.end());
    table.add_row({model.name, whole(level.mesh.triangles.size()), whole(level.mesh.positions.size()),
                   whole(split_at_seams(level.mesh, level.attributes).mesh.positions.size()),
                   percent(off[off.size() / 2]), percent(off[off.size() * 9 / 10])});
  }
}

struct Rule {
  const char* name;
  PlaneWeight weight;
  double past_share;
};
constexpr std::array<Rule, 4> kRules{{{"the source's: present planes, each alike", PlaneWeight::one, 0.0},
                                      {"present planes, by area", PlaneWeight::area, 0.0},
                                      {"by area, past planes 0.1", PlaneWeight::area, 0.1},
                                      {"by area, past planes 0.3 (ours)", PlaneWeight::area, 0.3}}};

Table rule_table() {
  std::vector<Column> columns{{"model", "", 0}, {"rule", "", 0}};
  for (const std::size_t count : kCounts) {
    columns.push_back({fmt::format("rms_percent_{}", count), fmt::format("{}: rms %", count), 4});
    columns.push_back({fmt::format("max_percent_{}", count), "max %", 3});
  }
  return Table(std::move(columns));
}

Result<void> add_rules(const Model& model, const Measure& measure, Table& table) {
  for (const Rule& rule : kRules) {
    ReductionOptions options;
    options.weight = rule.weight;
    options.past_share = rule.past_share;
    const Result<std::vector<ReducedLevel>> levels = reduce(model, options);
    if (!levels) return tl::unexpected(levels.error());
    std::vector<Cell> row{model.name, std::string(rule.name)};
    for (const ReducedLevel& level : *levels) {
      const Result<MeshDistance> distance = measure(level.mesh);
      if (!distance) return tl::unexpected(distance.error());
      row.emplace_back(percent(distance->relative_rms()));
      row.emplace_back(percent(distance->relative_max()));
    }
    table.add_row(std::move(row));
  }
  return {};
}

Result<void> draw(const Model& model, const Figures& figures, const glm::dvec3& from,
                  const std::filesystem::path& path) {
  constexpr std::uint32_t kWidth = 420, kHeight = 380;
  Result<OffscreenRenderer> renderer = OffscreenRenderer::create(kWidth, kHeight);
  if (!renderer) return tl::unexpected(renderer.error());
  FitOptions view;
  view.from = from;
  view.aspect = static_cast<double>(kWidth) / kHeight;
  const Camera camera = fit(model.mesh.positions, view);
  std::vector<ContactSheetEntry> entries;
  const auto add = [&](const TriangleMesh& mesh, const char* whose) -> Result<void> {
    const Result<FanMesh> fans = make_fan_mesh(mesh, CoverMethod::greedy);
    if (!fans) return tl::unexpected(fans.error());
    Result<Image> image = renderer->render(*fans, camera);
    if (!image) return tl::unexpected(image.error());
    entries.push_back({std::move(*image), {fmt::format("{} triangles", mesh.triangles.size()), whose}});
    return {};
  };
  for (const ReducedLevel& level : figures.ours) {
    if (auto added = add(level.mesh, "Fanstream"); !added) return added;
  }
  for (const SimplifyResult& peer : figures.peer) {
    // The peer may leave what is no manifold, which no fans cover.
    if (auto added = add(clean_mesh(peer.mesh).mesh, "meshoptimizer"); !added) return added;
  }
  ContactSheetOptions sheet;
  sheet.title = fmt::format("{}, reduced from {} triangles", model.name, model.mesh.triangles.size());
  sheet.columns = static_cast<std::uint32_t>(kCounts.size());
  const Result<Image> image = make_contact_sheet(entries, sheet);
  if (!image) return tl::unexpected(image.error());
  return write_png(*image, path);
}

}  // namespace

Result<std::vector<Section>> measure_reduction(const PapersOptions& options) {
  Table levels = level_table();
  Table times = time_table();
  Table rules = rule_table();
  Table textures = texture_table();
  for (const char* file : kModels) {
    if (options.progress) options.progress(fmt::format("reduction: {}", file));
    const Result<Model> model = read_model(options, file);
    if (!model) return tl::unexpected(model.error());
    const Result<Figures> figures = run_both(*model, options.quick ? 1 : 7);
    if (!figures) return tl::unexpected(figures.error());
    const Result<TriangleTree> tree = TriangleTree::build(model->mesh);
    if (!tree) return tl::unexpected(tree.error());
    const Measure measure(*model, *tree, options.quick);
    if (auto added = add_levels(*model, *figures, measure, levels); !added) return tl::unexpected(added.error());
    add_time(*model, *figures, times);
    const bool textured = std::string_view(file) == kTextured;
    if (auto added = add_rules(*model, measure, rules); !added) return tl::unexpected(added.error());
    if (textured) add_texture(*model, *figures, *tree, textures);
    if (!textured && std::string_view(file) != kPictured) continue;
    const auto picture = options.pictures / (textured ? "reduction_textured.png" : "reduction.png");
    if (auto drawn = draw(*model, *figures, textured ? glm::dvec3(-0.7, 0.4, -1.0) : FitOptions().from, picture);
        !drawn)
      return tl::unexpected(drawn.error());
  }
  std::vector<Section> sections;
  sections.push_back(
      {"reduction_levels",
       "Reduction on the device to the source's numbers (it shows a model of its own at about 4000, 2000, "
       "1000 and 200 polygons and no distances): distances from the model by its diagonal, beside "
       "meshoptimizer's simplifier at the same number. Pictures: reduction.png (bunny), "
       "reduction_textured.png (spot; its texture coordinates are reduced too, but drawn is the shape)",
       std::move(levels)});
  sections.push_back({"reduction_times",
                      "CPU time of one thread, least of several runs in turn: ours makes all four levels in one pass; "
                      "meshoptimizer starts from the model for each (its conversion to floats included)",
                      std::move(times)});
  sections.push_back({"reduction_texture",
                      "Texture coordinates, interpolated by the same k: at the middle of each triangle, their distance "
                      "from those of the closest point of the model, of the picture's side",
                      std::move(textures)});
  sections.push_back({"reduction_rules",
                      "Which planes an edge is judged by: the source's rule, and what area weights and a share of the "
                      "planes that were there before change",
                      std::move(rules)});
  return sections;
}

}  // namespace fanstream::bench
