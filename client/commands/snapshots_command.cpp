#include <fmt/format.h>

#include <cmath>

#include "client/commands/commands.h"
#include "client/commands/model_options.h"
#include "client/commands/output.h"
#include "client/render/contact_sheet.h"
#include "client/render/offscreen_renderer.h"
#include "common/fans/fan_shape.h"
#include "common/support/progress_bar.h"

namespace fanstream {
namespace {

struct Arguments {
  SourceArguments source;
  CameraArguments camera;
  unsigned levels = 8;
};

struct Snapshot {
  FanMesh fans;
  FanStatistics statistics;
  std::uint64_t bytes = 0;  // of the asset that this level takes
};

Result<Snapshot> take_snapshot(const ModelFetch& fetch, const TriangleMesh& mesh) {
  Result<FanMesh> fans = make_fan_mesh(mesh);
  if (!fans) return tl::unexpected(fans.error());
  const FetchReport report = fetch.report();
  const FanStatistics statistics = fan_statistics(mesh.positions.size(), *fans);
  return Snapshot{std::move(*fans), statistics, report.bytes.head + report.bytes.index + report.bytes.segments};
}

// FM0, levels of equal ratios of vertices, and the whole model; small models have fewer.
Result<std::vector<Snapshot>> take_snapshots(ModelFetch& fetch, unsigned levels, TriangleMesh& mesh) {
  const double base = fetch.mesh().vertex_count();
  const double full = fetch.mesh().head().vertex_count;
  std::vector<Snapshot> snapshots;
  for (unsigned i = 0; i < levels; ++i) {
    FetchGoal goal;
    if (i + 1 < levels)
      goal.vertices = static_cast<std::uint64_t>(std::lround(base * std::pow(full / base, i / (levels - 1.0))));
    if (const Result<void> advanced = fetch.advance(goal); !advanced) return tl::unexpected(advanced.error());
    if (!snapshots.empty() && snapshots.back().statistics.vertices == fetch.mesh().vertex_count()) continue;
    if (const Result<void> going = go_on(); !going) return tl::unexpected(going.error());
    mesh = fetch.mesh().triangle_mesh();
    Result<Snapshot> snapshot = take_snapshot(fetch, mesh);
    if (!snapshot) return tl::unexpected(snapshot.error());
    snapshots.push_back(std::move(*snapshot));
  }
  return snapshots;
}

std::vector<std::string> caption(const Snapshot& snapshot, const Snapshot& full) {
  const FanStatistics& s = snapshot.statistics;
  const double percent = 100.0 * static_cast<double>(snapshot.bytes) / static_cast<double>(full.bytes);
  return {fmt::format("{} vertices", grouped(s.vertices)),
          fmt::format("{} triangles in {} fans", grouped(s.faces), grouped(s.fans)),
          fmt::format("{} issued vertices, {:.2f} per vertex", grouped(s.issued_vertices), s.issued_per_vertex()),
          fmt::format("{} bytes, {:.{}f} %", grouped(snapshot.bytes), percent, percent < 10.0 ? 1 : 0)};
}

Json json_of(const Snapshot& snapshot) {
  return {{"bytes", snapshot.bytes},
          {"vertices", snapshot.statistics.vertices},
          {"triangles", snapshot.statistics.faces},
          {"fans", snapshot.statistics.fans},
          {"issued_vertices", snapshot.statistics.issued_vertices}};
}

// The pictures of all levels from where the whole model is seen.
Result<Image> draw_sheet(const std::vector<Snapshot>& snapshots, const CameraArguments& view, const Camera& camera,
                         const std::string& title) {
  Result<OffscreenRenderer> renderer = OffscreenRenderer::create(view.width, view.height);
  if (!renderer) return tl::unexpected(renderer.error());
  std::vector<ContactSheetEntry> entries;
  for (const Snapshot& snapshot : snapshots) {
    if (const Result<void> going = go_on(); !going) return tl::unexpected(going.error());
    Result<Image> image = renderer->render(snapshot.fans, camera);
    if (!image) return tl::unexpected(image.error());
    entries.push_back({std::move(*image), caption(snapshot, snapshots.back())});
  }
  ContactSheetOptions options;
  options.title = title;
  options.columns = entries.size() > 4 ? 4 : 0;
  return make_contact_sheet(entries, options);
}

int run_snapshots(Arguments& arguments) {
  if (const auto checked = arguments.camera.check(); !checked) return report_error(checked.error());
  const std::string& output = arguments.source.output;
  if (const auto writable = check_output_path(output, ".png"); !writable) return report_error(writable.error());
  ProgressBar bar(arguments.source.source);
  const Result<std::unique_ptr<ModelFetch>> fetch = open_model(arguments.source.source, bar);
  if (!fetch) return bar.finish(), report_error(fetch.error());
  TriangleMesh mesh;
  const Result<std::vector<Snapshot>> snapshots = take_snapshots(**fetch, arguments.levels, mesh);
  bar.finish();
  if (!snapshots) return report_error(snapshots.error());
  const Result<Camera> camera = arguments.camera.camera(mesh.positions);
  if (!camera) return report_error(camera.error());
  const FetchReport report = (*fetch)->report();
  const Result<Image> sheet = draw_sheet(*snapshots, arguments.camera, *camera, report.model);
  if (!sheet) return report_error(sheet.error());
  if (const auto written = write_png(*sheet, output); !written) return report_error(written.error());
  if (arguments.source.json) {
    Json levels = Json::array();
    for (const Snapshot& snapshot : *snapshots) levels.push_back(json_of(snapshot));
    Json json = json_of(report);
    json["levels"] = levels;
    json["output"] = output;
    return print_json(json);
  }
  fmt::print("{}{:>12} {:>12} {:>12} {:>12} {:>12}\n", summary_of(report), "bytes", "vertices", "triangles", "issued",
             "per vertex");
  for (const Snapshot& s : *snapshots) {
    fmt::print("{:>12} {:>12} {:>12} {:>12} {:>12.2f}\n", grouped(s.bytes), grouped(s.statistics.vertices),
               grouped(s.statistics.faces), grouped(s.statistics.issued_vertices), s.statistics.issued_per_vertex());
  }
  fmt::print("written     {}\n", output);
  return flush_output();
}

}  // namespace

Command add_snapshots_command(CLI::App& app) {
  const auto arguments = std::make_shared<Arguments>();
  arguments->camera.size = "480x400";
  CLI::App* command = app.add_subcommand("snapshots", "Draw a contact sheet of levels, from FM0 to all");
  add_source_arguments(*command, arguments->source, "Picture to write: .png");
  add_camera_arguments(*command, arguments->camera, "Pixels of each level: WxH");
  command->add_option("--levels", arguments->levels, "How many levels")
      ->capture_default_str()
      ->check(CLI::Range(2U, 24U));
  command->footer("Example:\n  fanstream-client snapshots localhost:7370/bunny -o bunny_levels.png");
  return {command, [arguments] { return run_snapshots(*arguments); }};
}

}  // namespace fanstream
