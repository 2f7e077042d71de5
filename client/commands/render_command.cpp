#include <fmt/format.h>

#include "client/commands/commands.h"
#include "client/commands/model_options.h"
#include "client/commands/output.h"
#include "client/commands/smooth_options.h"
#include "client/render/offscreen_renderer.h"
#include "common/fans/fan_shape.h"

namespace fanstream {
namespace {

struct Arguments {
  SourceArguments source;
  LevelArguments level;
  CameraArguments camera;
  SmoothArguments smooth;
  std::string draw = "fans";
};

// Past the finest level, if asked for. `mesh` is the model as it came.
Result<std::optional<SmoothReport>> smooth_mesh(const Arguments& arguments, const ProgressiveMesh& model,
                                                const Camera& camera, TriangleMesh& mesh) {
  if (!arguments.smooth.smooth) return std::optional<SmoothReport>();
  View view{camera, arguments.camera.width, arguments.camera.height, 0.0};
  view.near_distance = depth_range(camera, bounds_of(mesh.positions)).near_distance;
  Result<SmoothedMesh> smoothed = SilhouetteSmoother(arguments.smooth.options()).smooth(model, view);
  if (!smoothed) return tl::unexpected(with_context(smoothed.error(), arguments.source.source));
  mesh = std::move(smoothed->mesh);
  return std::optional(smoothed->report);
}

int run_render(Arguments& arguments) {
  if (const auto checked = arguments.camera.check(); !checked) return report_error(checked.error());
  const std::string& output = arguments.source.output;
  if (const auto writable = check_output_path(output, ".png"); !writable) return report_error(writable.error());
  const Result<LoadedModel> loaded = load_model(arguments.source.source, arguments.level);
  if (!loaded) return report_error(loaded.error());
  TriangleMesh mesh = loaded->fetch->mesh().triangle_mesh();
  const Result<Camera> camera = arguments.camera.camera(mesh.positions);
  if (!camera) return report_error(camera.error());
  const auto smoothed = smooth_mesh(arguments, loaded->fetch->mesh(), *camera, mesh);
  if (!smoothed) return report_error(smoothed.error());
  const Result<FanMesh> fans = make_fan_mesh(mesh);
  if (!fans) return report_error(with_context(fans.error(), arguments.source.source));
  if (const auto going = go_on(); !going && !loaded->broken) return report_error(going.error());
  Result<OffscreenRenderer> renderer = OffscreenRenderer::create(arguments.camera.width, arguments.camera.height);
  if (!renderer) return report_error(renderer.error());
  RenderOptions options;
  options.draw = arguments.draw == "fans" ? DrawMode::fans : DrawMode::triangles;
  const Result<Image> image = renderer->render(*fans, *camera, options);
  if (!image) return report_error(image.error());
  if (const auto going = go_on(); !going && !loaded->broken) return report_error(going.error());
  if (const auto written = write_png(*image, output); !written) return report_error(written.error());

  const FetchReport report = loaded->fetch->report();
  const FanStatistics statistics = fan_statistics(mesh.positions.size(), *fans);
  const bool as_fans = options.draw == DrawMode::fans;
  const std::uint64_t issued = as_fans ? statistics.issued_vertices : 3 * mesh.triangles.size();
  int printed = 0;
  if (arguments.source.json) {
    Json json = json_of(report);
    json["level"] = level_json(arguments.level.goal, report);
    if (*smoothed) json["smooth_silhouette"] = json_of(**smoothed);
    json["draw"] = arguments.draw;
    json["fans"] = statistics.fans;
    json["issued_vertices"] = issued;
    json["camera"] = {{"eye", json_of(camera->eye)}, {"target", json_of(camera->target)}, {"fov_deg", camera->fov_deg}};
    json["size_px"] = {arguments.camera.width, arguments.camera.height};
    json["output"] = output;
    printed = print_json(json);
  } else {
    fmt::print("{}{}{}drawn       as {} with {} issued vertices ({:.2f} per vertex)\nwritten     {}\n",
               summary_of(report), level_text(arguments.level.goal, report), *smoothed ? text_of(**smoothed) : "",
               as_fans ? grouped(statistics.fans) + " fans" : grouped(mesh.triangles.size()) + " triangles",
               grouped(issued), static_cast<double>(issued) / static_cast<double>(mesh.positions.size()), output);
    printed = flush_output();
  }
  return loaded->broken ? report_error(*loaded->broken) : printed;
}

}  // namespace

Command add_render_command(CLI::App& app) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("render", "Receive a model and draw it into a picture");
  add_source_arguments(*command, arguments->source, "Picture to write: .png");
  add_camera_arguments(*command, arguments->camera, "Pixels: WxH");
  add_level_arguments(*command, arguments->level);
  add_smooth_arguments(*command, arguments->smooth);
  command->add_option("--draw", arguments->draw, "As GL triangle fans or as indexed triangles")
      ->capture_default_str()
      ->check(CLI::IsMember({"fans", "triangles"}));
  command->footer(
      "Both ways of drawing give the same picture.\n"
      "Example:\n  fanstream-client render localhost:7370/bunny -o bunny.png --size 800x600 \\\n"
      "      --eye 0,0.1,0.4 --target 0,0.1,0 --fov 30");
  return {command, [arguments] { return run_render(*arguments); }};
}

}  // namespace fanstream
