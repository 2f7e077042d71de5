#include "client/commands/model_options.h"

#include <fmt/format.h>

#include <cmath>
#include <csignal>
#include <glm/geometric.hpp>

#include "client/commands/number_list.h"
#include "client/render/offscreen_renderer.h"
#include "common/support/progress_bar.h"

namespace fanstream {
namespace {

void request_stop(int) { stop_flag() = true; }

Result<std::optional<glm::dvec3>> point(const std::string& option, const std::string& text) {
  if (text.empty()) return std::nullopt;
  const auto list = parse_numbers<double>(text, ',');
  if (!list || list->size() != 3)
    return fail(ErrorKind::usage, option + " " + text + ": expected x,y,z, for example 0.5,1,-2");
  return glm::dvec3((*list)[0], (*list)[1], (*list)[2]);
}

double share(std::uint64_t done, std::uint64_t all) {
  return all == 0 ? 1.0 : static_cast<double>(done) / static_cast<double>(all);
}

}  // namespace

std::atomic<bool>& stop_flag() {
  static std::atomic<bool> stop{false};
  return stop;
}

void catch_stop_signals() {
  stop_flag();  // made before a signal can come
  std::signal(SIGINT, request_stop);
  std::signal(SIGTERM, request_stop);
}

Result<void> go_on() {
  if (stop_flag()) return fail(ErrorKind::interrupted, "stopped by the user; nothing was written");
  return {};
}

CLI::Validator not_zero() {
  return {[](const std::string& text) {
            const bool zero = text.find_first_not_of('0') == std::string::npos;
            return zero || text.front() == '-' ? std::string("must be at least 1") : std::string();
          },
          "POSITIVE"};
}

void add_source_arguments(CLI::App& command, SourceArguments& arguments, const std::string& output_help) {
  command.add_option("source", arguments.source, "HOST:PORT/MODEL, or an asset file")->required();
  command.add_option("-o,--output", arguments.output, output_help)->required();
  command.add_flag("--json", arguments.json, "Print the report as JSON");
}

void add_level_arguments(CLI::App& command, LevelArguments& arguments) {
  auto* vertices =
      command.add_option("--vertices", arguments.goal.vertices, "Stop at the level of at least so many vertices")
          ->check(not_zero());
  command.add_option("--bytes", arguments.goal.bytes, "Stop before more bytes than this are received")
      ->check(not_zero())
      ->excludes(vertices);
  command.add_flag("--keep-partial", arguments.keep_partial, "Write what came also if the transfer breaks off");
}

std::string level_text(const FetchGoal& goal, const FetchReport& report) {
  if (goal.vertices) {
    const char* which = report.vertices == *goal.vertices  ? "exactly that level"
                        : report.vertices > *goal.vertices ? "the next level above"
                                                           : "there are no more";
    return fmt::format("level       asked for {} vertices, got {}: {}\n", grouped(*goal.vertices),
                       grouped(report.vertices), which);
  }
  if (!goal.bytes) return {};
  const char* which = report.complete           ? "the whole model fits"
                      : report.bytes.index == 0 ? "FM0, the coarsest level"
                                                : "the finest level that fits";
  return fmt::format("level       asked for {} bytes, got {}: {}\n", grouped(*goal.bytes),
                     grouped(report.bytes.received), which);
}

Json level_json(const FetchGoal& goal, const FetchReport& report) {
  if (!goal.vertices && !goal.bytes) return nullptr;
  const std::uint64_t asked = goal.vertices ? *goal.vertices : *goal.bytes;
  const std::uint64_t got = goal.vertices ? report.vertices : report.bytes.received;
  return {{"by", goal.vertices ? "vertices" : "bytes"},
          {"asked", asked},
          {"got", got},
          {"is", got == asked  ? "exact"
                 : got > asked ? "above"
                               : "below"}};
}

Result<std::unique_ptr<ModelFetch>> open_model(const std::string& source, ProgressBar& bar) {
  FetchOptions options;
  options.source.client.stop = &stop_flag();
  options.source.on_building = [&bar](double fraction) { bar.update("server builds", fraction); };
  options.on_progress = [&bar](const FetchProgress& p) {
    bar.update("receiving", std::max(share(p.vertices, p.goal_vertices), share(p.bytes, p.goal_bytes)));
  };
  return ModelFetch::open(source, options);
}

Result<LoadedModel> load_model(const std::string& source, const LevelArguments& level) {
  ProgressBar bar(source);
  Result<std::unique_ptr<ModelFetch>> fetch = open_model(source, bar);
  if (!fetch) return tl::unexpected(fetch.error());
  LoadedModel loaded{std::move(*fetch), {}};
  if (const Result<void> advanced = loaded.fetch->advance(level.goal); !advanced) {
    if (!level.keep_partial) return tl::unexpected(advanced.error());
    loaded.broken = advanced.error();
  }
  return loaded;
}

void add_camera_arguments(CLI::App& command, CameraArguments& arguments, const std::string& size_help) {
  command.add_option("--size", arguments.size, size_help)->capture_default_str();
  command.add_option("--eye", arguments.eye, "Where the eye is: x,y,z (default: all is seen)");
  command.add_option("--target", arguments.target, "What it looks at (default: the model's centre)");
  command.add_option("--up", arguments.up, "Which way is up: x,y,z (default 0,1,0)");
  command.add_option("--fov", arguments.fov_deg, "Degrees seen from bottom to top")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 170.0));
}

Result<void> CameraArguments::check() {
  const auto sides = parse_numbers<std::uint32_t>(size, 'x');
  if (!sides || sides->size() != 2)
    return fail(ErrorKind::usage, "--size " + size + ": expected WxH, for example 1024x768");
  width = (*sides)[0];
  height = (*sides)[1];
  if (width == 0 || height == 0 || width > OffscreenRenderer::kLargestSidePx ||
      height > OffscreenRenderer::kLargestSidePx || std::uint64_t{width} * height > OffscreenRenderer::kMostPixels) {
    return fail(ErrorKind::usage,
                fmt::format("--size {}: each side is 1 to {}, and {} pixels are the most", size,
                            OffscreenRenderer::kLargestSidePx, grouped(OffscreenRenderer::kMostPixels)));
  }
  for (auto [option, text, value] :
       {std::tuple{"--eye", &eye, &eye_}, {"--target", &target, &target_}, {"--up", &up, &up_}}) {
    Result<std::optional<glm::dvec3>> read = point(option, *text);
    if (!read) return tl::unexpected(read.error());
    *value = *read;
  }
  if (target_ && !eye_) return fail(ErrorKind::usage, "--target needs --eye");
  return {};
}

Result<Camera> CameraArguments::camera(const std::vector<glm::dvec3>& positions) const {
  const glm::dvec3 up_vector = up_.value_or(glm::dvec3(0, 1, 0));
  Camera camera;
  if (eye_) {
    const Bounds bounds = bounds_of(positions);
    camera = {*eye_, target_.value_or((bounds.low + bounds.high) / 2.0), up_vector, fov_deg};
    const glm::dvec3 view = camera.target - camera.eye;
    // Straight up or down, where nobody has said which way is up.
    if (!up_ && glm::length(glm::cross(view, up_vector)) <= 1e-9 * glm::length(view)) camera.up = {0, 0, -1};
  } else {
    FitOptions options;
    options.up = up_vector;
    options.fov_deg = fov_deg;
    options.aspect = static_cast<double>(width) / height;
    if (up_ && std::abs(up_vector.z) > std::abs(up_vector.y)) options.from = {0.5, -1.0, 0.4};  // z is up: seen from -y
    camera = fit(positions, options);
  }
  if (const Result<void> checked = check_camera(camera); !checked) return tl::unexpected(checked.error());
  return camera;
}

}  // namespace fanstream
