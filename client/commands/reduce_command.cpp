// Levels of detail made on the device, once, and stored.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <limits>

#include "client/commands/commands.h"
#include "client/commands/model_options.h"
#include "client/commands/number_list.h"
#include "client/commands/output.h"
#include "client/commands/reduce_source.h"
#include "client/export/level_store.h"
#include "client/export/mesh_export.h"
#include "client/reduce/mesh_reduction.h"
#include "client/render/contact_sheet.h"
#include "client/render/offscreen_renderer.h"
#include "common/fans/fan_shape.h"
#include "common/geometry/mesh_distance.h"
#include "common/support/progress_bar.h"

namespace fanstream {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

// Changed whenever the same source and options would give other levels.
constexpr const char* kMethod = "edge merges 1";
constexpr const char* kPictureName = "levels.png";

struct Arguments {
  SourceArguments source;
  std::string triangles;              // "4000,2000"
  std::vector<std::uint64_t> counts;  // the same, from large to small, each once
  std::string format = "glb";
  std::string weight = "area";
  ReductionOptions options;
  CameraArguments camera;
  bool no_picture = false;
};

struct Seconds {
  double load = 0.0, reduce = 0.0, measure = 0.0, draw = 0.0;
};

double since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

std::string settings_of(const Arguments& arguments) {
  return fmt::format("{}, {}, weight {}, past {}, picture {}", kMethod, arguments.format, arguments.weight,
                     arguments.options.past_share,
                     arguments.no_picture
                         ? "none"
                         : arguments.camera.size + " " + arguments.camera.eye + " " + arguments.camera.target + " " +
                               arguments.camera.up + " " + fmt::format("{}", arguments.camera.fov_deg));
}

// Of "N,N,...", from large to small, each once.
Result<std::vector<std::uint64_t>> parse_counts(const std::string& text) {
  const auto list = parse_numbers<std::uint32_t>(text, ',');
  if (!list || std::find(list->begin(), list->end(), 0U) != list->end()) {
    return fail(ErrorKind::usage, fmt::format("--triangles {}: expected whole numbers from 1 to {}, for example "
                                              "4000,2000,1000,200",
                                              text, std::numeric_limits<std::uint32_t>::max()));
  }
  std::vector<std::uint64_t> counts(list->begin(), list->end());
  std::sort(counts.begin(), counts.end(), std::greater<>());
  counts.erase(std::unique(counts.begin(), counts.end()), counts.end());
  return counts;
}

// Makes, measures, draws and stores the levels of one mesh.
class LevelMaker {
 public:
  LevelMaker(const Arguments& arguments, const std::string& name, const ReduceMesh& source, ProgressBar& bar)
      : arguments_(arguments), name_(name), source_(source), bar_(bar), folder_(arguments.source.output) {}

  // `manifest` is what is wanted, and gets what is made.
  Result<void> run(LevelManifest& manifest, Seconds& seconds) {
    manifest.source_triangles = source_.mesh.triangles.size();
    manifest.source_vertices = source_.mesh.positions.size();
    manifest.has_texture_coordinates = !source_.attributes.values.texture_coordinates.empty();
    manifest.has_colors = !source_.attributes.values.colors.empty();
    Clock::time_point start = Clock::now();
    Result<TriangleTree> tree = TriangleTree::build(source_.mesh);
    if (!tree) return tl::unexpected(tree.error());
    tree_ = &*tree;
    if (auto begun = begin_picture(); !begun) return begun;
    seconds.measure = since(start);
    start = Clock::now();
    if (auto reduced = reduce(manifest); !reduced) return reduced;
    seconds.reduce = since(start) - measure_s_ - draw_s_;
    seconds.measure += measure_s_;
    start = Clock::now();
    if (auto stored = store_picture(manifest); !stored) return stored;
    if (auto stored = store_manifest(folder_, manifest); !stored) return stored;
    seconds.draw = draw_s_ + since(start);
    return {};
  }

 private:
  Result<void> reduce(LevelManifest& manifest) {
    std::vector<std::size_t> counts;
    for (const StoredLevel& level : manifest.levels) counts.push_back(level.asked_triangles);
    ReductionOptions options = arguments_.options;
    options.weight = arguments_.weight == "area" ? PlaneWeight::area : PlaneWeight::one;
    options.go_on = [this](double fraction) {
      bar_.update("reducing", fraction);
      return !stop_flag();
    };
    std::size_t next = 0;
    return reduce_mesh(source_.mesh, source_.attributes, counts, options,
                       [&](ReducedLevel&& level) -> Result<void> { return take(level, manifest.levels[next++]); });
  }

  Result<void> take(const ReducedLevel& level, StoredLevel& stored) {
    if (stop_flag()) return fail(ErrorKind::interrupted, "stopped by the user");
    Clock::time_point start = Clock::now();
    DistanceOptions sampling;
    sampling.face_samples = 50'000;
    const Result<MeshDistance> distance = mesh_distance(source_.mesh, *tree_, level.mesh, sampling);
    if (!distance) return tl::unexpected(distance.error());
    measure_s_ += since(start);
    start = Clock::now();
    stored.triangles = level.mesh.triangles.size();
    stored.vertices = level.mesh.positions.size();
    stored.relative_rms = distance->relative_rms();
    stored.relative_max = distance->relative_max();
    stored.shortfall = level.shortfall;
    const std::string name = fmt::format("{}_{}.{}", name_, stored.asked_triangles, arguments_.format);
    const VertexAttributedMesh split = split_at_seams(level.mesh, level.attributes);
    const auto format = mesh_file_format(name);
    if (!format) return tl::unexpected(format.error());
    const auto bytes = encode_mesh(split.mesh.positions, split.mesh.triangles, *format, split.attributes);
    if (!bytes) return tl::unexpected(with_context(bytes.error(), name));
    Result<StoredFile> file = store_file(folder_, name, *bytes);
    if (!file) return tl::unexpected(file.error());
    stored.file = std::move(*file);
    Result<void> drawn = draw(level.mesh, caption(stored));
    draw_s_ += since(start);
    return drawn;
  }

  static std::vector<std::string> caption(const StoredLevel& level) {
    return {grouped(level.triangles) + " triangles", grouped(level.vertices) + " vertices",
            fmt::format("off by {:.3g} % of the diagonal, at most {:.3g} %", 100.0 * level.relative_rms,
                        100.0 * level.relative_max)};
  }

  Result<void> begin_picture() {
    if (arguments_.no_picture) return {};
    const Result<Camera> camera = arguments_.camera.camera(source_.mesh.positions);
    if (!camera) return tl::unexpected(camera.error());
    camera_ = *camera;
    Result<OffscreenRenderer> renderer = OffscreenRenderer::create(arguments_.camera.width, arguments_.camera.height);
    if (!renderer) return tl::unexpected(renderer.error());
    renderer_ = std::make_unique<OffscreenRenderer>(std::move(*renderer));
    return draw(source_.mesh, {grouped(source_.mesh.triangles.size()) + " triangles",
                               grouped(source_.mesh.positions.size()) + " vertices", "the source"});
  }

  Result<void> draw(const TriangleMesh& mesh, std::vector<std::string> text) {
    if (!renderer_) return {};
    RenderOptions options;
    options.draw = DrawMode::triangles;
    Result<Image> image = renderer_->render(make_triangle_fans(mesh), camera_, options);
    if (!image) return tl::unexpected(image.error());
    entries_.push_back({std::move(*image), std::move(text)});
    return {};
  }

  Result<void> store_picture(LevelManifest& manifest) {
    if (!renderer_) return {};
    ContactSheetOptions options;
    options.title = name_;
    options.columns = entries_.size() > 6 ? 0 : static_cast<std::uint32_t>(std::min<std::size_t>(entries_.size(), 3));
    const Result<Image> sheet = make_contact_sheet(entries_, options);
    if (!sheet) return tl::unexpected(sheet.error());
    const auto bytes = encode_png(*sheet);
    if (!bytes) return tl::unexpected(bytes.error());
    Result<StoredFile> file = store_file(folder_, kPictureName, *bytes);
    if (!file) return tl::unexpected(file.error());
    manifest.picture = std::move(*file);
    return {};
  }

  const Arguments& arguments_;
  const std::string& name_;
  const ReduceMesh& source_;
  ProgressBar& bar_;
  fs::path folder_;
  const TriangleTree* tree_ = nullptr;
  std::unique_ptr<OffscreenRenderer> renderer_;
  Camera camera_;
  std::vector<ContactSheetEntry> entries_;
  double measure_s_ = 0.0, draw_s_ = 0.0;
};

// What a run has come to.
struct Outcome {
  LevelManifest manifest;
  bool again = false;    // what was stored is used again
  std::string obstacle;  // else: why not
  std::vector<std::string> notes;
  Seconds seconds;
};

int print_as_json(const Arguments& arguments, const Outcome& outcome) {
  const LevelManifest& manifest = outcome.manifest;
  const fs::path folder = arguments.source.output;
  Json levels = Json::array();
  bool degraded = false;
  for (const StoredLevel& level : manifest.levels) {
    degraded = degraded || !level.shortfall.empty();
    levels.push_back({{"asked_triangles", level.asked_triangles},
                      {"triangles", level.triangles},
                      {"vertices", level.vertices},
                      {"reached", level.shortfall.empty()},
                      {"shortfall", level.shortfall.empty() ? Json(nullptr) : Json(level.shortfall)},
                      {"relative_rms", level.relative_rms},
                      {"relative_max", level.relative_max},
                      {"file", (folder / level.file.name).string()},
                      {"size_bytes", level.file.size_bytes}});
  }
  Json json{{"source", manifest.source},
            {"source_hash", manifest.source_hash},
            {"source_triangles", manifest.source_triangles},
            {"source_vertices", manifest.source_vertices},
            {"texture_coordinates", manifest.has_texture_coordinates},
            {"colors", manifest.has_colors},
            {"used_again", outcome.again},
            {"made_because", outcome.again ? Json(nullptr) : Json(outcome.obstacle)},
            {"degraded", degraded},
            {"levels", std::move(levels)},
            {"notes", outcome.notes}};
  json["seconds"] = {{"load", outcome.seconds.load},
                     {"reduce", outcome.seconds.reduce},
                     {"measure", outcome.seconds.measure},
                     {"draw_and_write", outcome.seconds.draw}};
  json["picture"] = manifest.picture ? Json((folder / manifest.picture->name).string()) : Json(nullptr);
  return print_json(json);
}

int print_as_text(const Arguments& arguments, const Outcome& outcome) {
  const LevelManifest& manifest = outcome.manifest;
  fmt::print("source      {} triangles, {} vertices{}{}\n", grouped(manifest.source_triangles),
             grouped(manifest.source_vertices), manifest.has_texture_coordinates ? ", texture coordinates" : "",
             manifest.has_colors ? ", colours" : "");
  for (const std::string& note : outcome.notes) fmt::print("note        {}\n", note);
  fmt::print("\n{:>10} {:>10} {:>10} {:>10} {:>10}  {}\n", "asked", "triangles", "vertices", "rms %", "max %", "file");
  for (const StoredLevel& level : manifest.levels) {
    fmt::print("{:>10} {:>10} {:>10} {:>10.3g} {:>10.3g}  {}\n", grouped(level.asked_triangles),
               grouped(level.triangles), grouped(level.vertices), 100.0 * level.relative_rms,
               100.0 * level.relative_max, level.file.name);
  }
  fmt::print("            (distances from the source, of its diagonal)\n\n");
  for (const StoredLevel& level : manifest.levels) {
    if (level.shortfall.empty()) continue;
    fmt::print("degraded    {} triangles were not reached:\n            {}\n", grouped(level.asked_triangles),
               level.shortfall);
    break;
  }
  if (outcome.again) {
    fmt::print("used again  {} holds these levels of the same source: nothing to do\n", arguments.source.output);
  } else {
    const Seconds& s = outcome.seconds;
    fmt::print("seconds     loaded {:.3f}, reduced {:.3f}, measured {:.3f}, drawn and written {:.3f}\n", s.load,
               s.reduce, s.measure, s.draw);
    fmt::print("written     {}: {} files{}, {}\n", arguments.source.output, manifest.levels.size(),
               manifest.picture ? fmt::format(", {}", manifest.picture->name) : std::string(), kManifestName);
  }
  return flush_output();
}

LevelManifest wanted_manifest(const Arguments& arguments, const ReduceSource& source) {
  LevelManifest wanted;
  wanted.source = arguments.source.source;
  wanted.source_hash = source.hash();
  wanted.settings = settings_of(arguments);
  for (const std::uint64_t count : arguments.counts) {
    wanted.levels.emplace_back();
    wanted.levels.back().asked_triangles = count;
  }
  return wanted;
}

Result<Outcome> make_levels(const Arguments& arguments, ProgressBar& bar) {
  const Clock::time_point start = Clock::now();
  Result<ReduceSource> source = ReduceSource::open(arguments.source.source, bar);
  if (!source) return tl::unexpected(source.error());
  Outcome outcome;
  outcome.manifest = wanted_manifest(arguments, *source);
  StoredLevels stored = find_levels(arguments.source.output, outcome.manifest, !arguments.no_picture);
  if (stored.manifest) {
    outcome.manifest = std::move(*stored.manifest);
    outcome.again = true;
    return outcome;
  }
  outcome.obstacle = std::move(stored.obstacle);
  Result<ReduceMesh> mesh = source->load(bar);
  if (!mesh) return tl::unexpected(mesh.error());
  outcome.notes = std::move(mesh->notes);
  outcome.seconds.load = since(start);
  if (auto going = go_on(); !going) return tl::unexpected(going.error());
  if (auto made = make_output_folder(arguments.source.output); !made) return tl::unexpected(made.error());
  LevelMaker maker(arguments, source->name(), *mesh, bar);
  if (auto made = maker.run(outcome.manifest, outcome.seconds); !made) {
    return tl::unexpected(with_context(made.error(), arguments.source.source));
  }
  return outcome;
}

int run_reduce(Arguments& arguments) {
  if (const auto checked = arguments.camera.check(); !checked) return report_error(checked.error());
  Result<std::vector<std::uint64_t>> counts = parse_counts(arguments.triangles);
  if (!counts) return report_error(counts.error());
  arguments.counts = std::move(*counts);
  if (const auto checked = check_output_folder(arguments.source.output); !checked) return report_error(checked.error());
  ProgressBar bar(arguments.source.source);
  const Result<Outcome> outcome = make_levels(arguments, bar);
  bar.finish();
  if (!outcome) return report_error(outcome.error());
  return arguments.source.json ? print_as_json(arguments, *outcome) : print_as_text(arguments, *outcome);
}

}  // namespace

Command add_reduce_command(CLI::App& app) {
  const auto arguments = std::make_shared<Arguments>();
  arguments->camera.size = "480x400";
  CLI::App* command = app.add_subcommand("reduce", "Make levels of detail here, once, and store them");
  command->add_option("source", arguments->source.source, "HOST:PORT/MODEL, an asset file, or a mesh file")->required();
  command->add_option("-o,--output", arguments->source.output, "Folder to write to; made if it is missing")->required();
  command->add_flag("--json", arguments->source.json, "Print the report as JSON");
  command->add_option("--triangles", arguments->triangles, "How many triangles to reduce to: N,N,...")->required();
  command->add_option("--format", arguments->format, "Of the level files")
      ->capture_default_str()
      ->check(CLI::IsMember({"glb", "ply", "obj"}));
  command->add_option("--weight", arguments->weight, "Of planes: area, or one as in the source paper")
      ->capture_default_str()
      ->check(CLI::IsMember({"area", "one"}));
  command->add_option("--past", arguments->options.past_share, "Share of planes that were; 0 as in the paper")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 100.0));
  command->add_flag("--no-picture", arguments->no_picture, "Draw no levels.png");
  add_camera_arguments(*command, arguments->camera, "Pixels of each level: WxH");
  command->footer(
      "Texture coordinates and colours of mesh files are kept; images are not.\n"
      "Where DIR holds the same levels of the same source already, nothing is done.\n"
      "Example:\n  fanstream-client reduce bunny.ply --triangles 4000,2000,1000,200 -o lods");
  return {command, [arguments] { return run_reduce(*arguments); }};
}

}  // namespace fanstream
