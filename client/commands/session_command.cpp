#include "client/commands/session_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "client/commands/model_options.h"
#include "client/commands/output.h"
#include "client/commands/smooth_options.h"
#include "client/session/built_in_paths.h"
#include "client/session/camera_path_file.h"
#include "client/session/session_run.h"
#include "common/fans/fan_shape.h"
#include "common/support/progress_bar.h"

namespace fanstream {
namespace {

struct Arguments {
  SourceArguments source;
  std::string path = "orbit";
  std::string size;
  std::optional<double> fps, tolerance_px, fov_deg;
  std::vector<double> up;
  std::optional<double> link_mbit, rtt_ms;
  bool real_time = false;
  std::optional<std::uint64_t> triangles, memory_mib;
  std::string cache;
  SmoothArguments smooth;
  bool no_pictures = false;
};

bool is_built_in(const std::string& path) {
  return std::find(kBuiltInPaths.begin(), kBuiltInPaths.end(), path) != kBuiltInPaths.end();
}

// What the command line says over what the path says.
Result<void> apply_arguments(const Arguments& arguments, CameraPath& path) {
  if (!arguments.size.empty()) {
    CameraArguments picture;
    picture.size = arguments.size;
    if (auto checked = picture.check(); !checked) return checked;
    path.width = picture.width;
    path.height = picture.height;
  }
  if (arguments.fps) path.fps = *arguments.fps;
  for (CameraKeyframe& key : path.keyframes) {
    if (arguments.tolerance_px) key.tolerance_px = *arguments.tolerance_px;
    if (arguments.fov_deg) key.camera.fov_deg = *arguments.fov_deg;
  }
  return {};
}

Result<BuiltInPathOptions> built_in_options(const Arguments& arguments) {
  CameraPath path;
  if (auto applied = apply_arguments(arguments, path); !applied) return tl::unexpected(applied.error());
  BuiltInPathOptions options;
  options.fps = path.fps;
  options.width = path.width;
  options.height = path.height;
  options.tolerance_px = arguments.tolerance_px.value_or(options.tolerance_px);
  options.fov_deg = arguments.fov_deg.value_or(options.fov_deg);
  if (options.fov_deg > 120.0) return fail(ErrorKind::usage, "--fov: 120 degrees are the most for a built-in path");
  if (!arguments.up.empty()) {
    options.up = {arguments.up[0], arguments.up[1], arguments.up[2]};
    const double length = std::hypot(options.up.x, options.up.y, options.up.z);
    if (!std::isfinite(length) || length < 1e-100) return fail(ErrorKind::usage, "--up: is no direction");
  }
  return options;
}

// A path for the checks that need no model: the file's, or the built-in one around a ball of radius 1.
Result<CameraPath> read_path(const Arguments& arguments) {
  if (is_built_in(arguments.path)) {
    const Result<BuiltInPathOptions> options = built_in_options(arguments);
    if (!options) return tl::unexpected(options.error());
    return *built_in_path(arguments.path, {{-1, -1, -1}, {1, 1, 1}}, *options);
  }
  if (!arguments.up.empty()) return fail(ErrorKind::usage, "--up: is for built-in paths; a path file says it itself");
  Result<CameraPath> path = read_camera_path(arguments.path);
  if (!path && path.error().kind == ErrorKind::not_found) {
    return fail(ErrorKind::not_found,
                fmt::format("--path {}: there is neither such a file nor a built-in path of that name; there are {}",
                            arguments.path, fmt::join(kBuiltInPaths, ", ")));
  }
  return path;
}

Result<CameraPath> checked_path(const Arguments& arguments) {
  Result<CameraPath> path = read_path(arguments);
  if (!path) return path;
  if (auto applied = apply_arguments(arguments, *path); !applied) return tl::unexpected(applied.error());
  if (auto checked = check_path(*path); !checked) return tl::unexpected(checked.error());
  return path;
}

Result<void> check_arguments(const Arguments& arguments) {
  if (arguments.real_time && (arguments.link_mbit || arguments.rtt_ms)) {
    return fail(ErrorKind::usage, "--real-time: runs over the network there is; --link-mbit and --rtt-ms simulate one");
  }
  if (!arguments.cache.empty() && !arguments.real_time) {
    return fail(ErrorKind::usage, "--cache: is for --real-time; a simulated link starts with nothing every time");
  }
  return check_output_folder(arguments.source.output);
}

SessionSettings settings_of(const Arguments& arguments, const CameraPath& path, ProgressBar& bar) {
  SessionSettings settings;
  settings.source = arguments.source.source;
  settings.width = path.width;
  settings.height = path.height;
  settings.real_time = arguments.real_time;
  settings.link = symmetric_link(arguments.link_mbit.value_or(10.0), arguments.rtt_ms.value_or(50.0));
  settings.triangle_budget = arguments.triangles;
  if (arguments.smooth.smooth) {
    settings.smooth = arguments.smooth.options();
    settings.smooth->stop = nullptr;  // the run itself looks between frames, and keeps what there is
    if (arguments.triangles) settings.smooth->max_triangles = *arguments.triangles;
  }
  if (arguments.memory_mib) settings.memory_budget_bytes = *arguments.memory_mib << 20U;
  if (!arguments.cache.empty()) settings.cache_folder = arguments.cache;
  settings.whole_model = !(arguments.real_time && arguments.no_pictures);
  settings.stop = &stop_flag();
  settings.progress = [&bar](std::string_view stage, double fraction) { bar.update(stage, fraction); };
  settings.on_notice = [&bar, source = arguments.source.source](const std::string& text) {
    bar.finish();
    fmt::print(stderr, "{}: {}\n", source, text);
  };
  return settings;
}

// What the pictures and the download are compared with.
struct Reference {
  std::optional<FanMesh> mesh;
  std::optional<PeerDownload> draco;
};
Result<Reference> make_reference(const Arguments& arguments, const OpenedSession& opened, ProgressBar& bar) {
  Reference reference;
  if (!opened.full) return reference;
  bar.update("coding with Draco", 0.0);
  const Result<GridMesh> grid = grid_mesh(*opened.full, opened.grid_step);
  if (!grid) return tl::unexpected(grid.error());
  constexpr int kSmallest = 10;
  const Result<DracoFile> draco = make_draco_file(*grid, kSmallest, 3);
  if (!draco) return tl::unexpected(draco.error());
  // In real time the link is what it is, and nobody has measured it.
  if (!arguments.real_time) {
    const VirtualLinkOptions link = symmetric_link(arguments.link_mbit.value_or(10.0), arguments.rtt_ms.value_or(50.0));
    reference.draco = download_of(*draco, link);
  }
  if (arguments.no_pictures) return reference;
  bar.update("covering with fans", 0.0);
  Result<FanMesh> fans = make_fan_mesh(*opened.full);
  if (!fans) return tl::unexpected(fans.error());
  reference.mesh = std::move(*fans);
  return reference;
}

SessionHeader header_of(const Arguments& arguments, const OpenedSession& opened, const CameraPath& path) {
  SessionHeader header{arguments.source.source,
                       opened.model,
                       opened.digest,
                       path.name,
                       path.width,
                       path.height,
                       path.fps,
                       !arguments.real_time,
                       {},
                       {}};
  if (!arguments.real_time) {
    header.link_mbit_s = arguments.link_mbit.value_or(10.0);
    header.round_trip_ms = arguments.rtt_ms.value_or(50.0);
  }
  return header;
}

int print_report(const Arguments& arguments, const SessionHeader& header, const SessionRunReport& report) {
  if (arguments.source.json) {
    Json json = Json::parse(to_json(header, report.summary, {}));
    json["written"] = Json::array();
    for (const std::filesystem::path& path : report.written) json["written"].push_back(path.string());
    json["animation_complete"] = report.animation_complete;
    return print_json(json);
  }
  fmt::print("{}", to_text(header, report.summary));
  if (!report.animation_complete) fmt::print("animation   ends before the path does: it would be too large\n");
  fmt::print("written     {}\n", arguments.source.output);
  return flush_output();
}

// The run itself, with everything checked and the session open.
int play(const Arguments& arguments, const CameraPath& path, OpenedSession& opened, ProgressBar& bar) {
  const Result<Reference> reference = make_reference(arguments, opened, bar);
  if (!reference) return bar.finish(), report_error(with_context(reference.error(), arguments.source.source));
  SessionRunOptions options;
  options.folder = arguments.source.output;
  options.pictures = !arguments.no_pictures;
  options.real_time = arguments.real_time;
  options.header = header_of(arguments, opened, path);
  options.full_model = reference->mesh ? &*reference->mesh : nullptr;
  options.depth_bounds = opened.bounds;
  options.draco = reference->draco;
  options.go_on = []() -> Result<void> {
    if (stop_flag()) return fail(ErrorKind::interrupted, "stopped by the user");
    return {};
  };
  options.progress = [&bar](std::string_view stage, double fraction) { bar.update(stage, fraction); };
  const Result<SessionRunReport> report = run_session(*opened.session, path, options);
  bar.finish();
  if (!report) return report_error(report.error());
  const int printed = print_report(arguments, options.header, *report);
  if (!report->ended_early) return printed;
  return report_error({report->ended_early->kind,
                       fmt::format("{}; {} frames were written", report->ended_early->message, report->frames.size())});
}

int run_session_command(const Arguments& arguments, const SessionOpener& opener) {
  Result<CameraPath> path = checked_path(arguments);
  if (!path) return report_error(path.error());
  if (const auto checked = check_arguments(arguments); !checked) return report_error(checked.error());
  ProgressBar bar(arguments.source.source);
  Result<OpenedSession> opened = opener(settings_of(arguments, *path, bar));
  if (!opened) return bar.finish(), report_error(opened.error());
  if (is_built_in(arguments.path)) {
    path = *built_in_path(arguments.path, opened->bounds, built_in_options(arguments).value());
  }
  return play(arguments, *path, *opened, bar);
}

void add_path_arguments(CLI::App& command, Arguments& arguments) {
  command.add_option("--path", arguments.path, "A JSON file, or orbit, approach, fly-by, jump")->capture_default_str();
  command.add_option("--size", arguments.size, "Pixels: WxH [as the path says, or 1024x768]");
  command.add_option("--fps", arguments.fps, "Frames a second [as the path says, or 25]")
      ->check(CLI::Range(0.1, 240.0));
  command.add_option("--tolerance-px", arguments.tolerance_px, "Error to refine to [as the path says, or 1]")
      ->check(CLI::Range(1e-3, 1e4));
  command.add_option("--fov", arguments.fov_deg, "Degrees from bottom to top [the path's, or 35]")
      ->check(CLI::Range(1.0, 170.0));
  command.add_option("--up", arguments.up, "x,y,z: which way is up for a built-in path")->delimiter(',')->expected(3);
}

void add_session_arguments(CLI::App& command, Arguments& arguments) {
  command.add_option("--link-mbit", arguments.link_mbit, "Rate of the simulated link in Mbit/s [10]")
      ->check(CLI::Range(1e-3, 1e5));
  command.add_option("--rtt-ms", arguments.rtt_ms, "Round trip of the simulated link [50]")
      ->check(CLI::Range(0.0, 1e4));
  command.add_flag("--real-time", arguments.real_time, "Play by the clock, over the network there is");
  command.add_option("--triangles", arguments.triangles, "Budget: draw at most so many")->check(not_zero());
  command
      .add_option("--memory-mib", arguments.memory_mib,
                  "Budget: hold at most so much of the model, beside the program itself")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 20U));
  command.add_option("--cache", arguments.cache, "Folder that keeps what comes (--real-time)");
  add_smooth_arguments(command, arguments.smooth);
  command.add_flag("--no-pictures", arguments.no_pictures, "Only tables and plots: faster");
}

}  // namespace

Command add_session_command(CLI::App& app, SessionOpener opener) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("session", "Play a camera path while the model streams in");
  add_source_arguments(*command, arguments->source, "Folder to write to; made if it is missing");
  add_path_arguments(*command, *arguments);
  add_session_arguments(*command, *arguments);
  command->footer(
      "Writes frames/, animation.png (APNG), contact_sheet.png, frames.csv,\n"
      "session.json, and plots of error against bytes and time beside Draco's.\n"
      "Time is virtual unless --real-time is given: every run is the same.\n"
      "Example:\n  fanstream-client session bunny.fan --path jump -o session --rtt-ms 80");
  return {command, [arguments, opener] { return run_session_command(*arguments, opener); }};
}

}  // namespace fanstream
