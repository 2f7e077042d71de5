// The options that fetch, render and snapshots share, and what they do.
#pragma once

#include <CLI/CLI.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <string>

#include "client/commands/output.h"
#include "client/model/model_fetch.h"
#include "client/view/camera.h"

namespace fanstream {

class ProgressBar;

// Set by SIGINT and SIGTERM from catch_stop_signals() on.
std::atomic<bool>& stop_flag();
void catch_stop_signals();
// Fails (interrupted) once a signal has come: asked before every step that takes long, and before writing.
Result<void> go_on();

struct SourceArguments {
  std::string source;
  std::string output;
  bool json = false;
};
// For whole numbers above 0: CLI::PositiveNumber writes its limits out to 300 digits.
CLI::Validator not_zero();

void add_source_arguments(CLI::App& command, SourceArguments& arguments, const std::string& output_help);

struct LevelArguments {
  FetchGoal goal;
  bool keep_partial = false;
};
void add_level_arguments(CLI::App& command, LevelArguments& arguments);

// "asked for 5,000 vertices: ..." where a level was asked for; else empty.
std::string level_text(const FetchGoal& goal, const FetchReport& report);
Json level_json(const FetchGoal& goal, const FetchReport& report);

// A model received as far as wanted. `broken` holds the error that ended the transfer early if what came is to be kept.
struct LoadedModel {
  std::unique_ptr<ModelFetch> fetch;
  std::optional<Error> broken;
};
// With progress on standard error.
Result<LoadedModel> load_model(const std::string& source, const LevelArguments& level);
// Opens the source with progress on standard error, for callers that go on step by step.

Result<std::unique_ptr<ModelFetch>> open_model(const std::string& source, ProgressBar& bar);

struct CameraArguments {
  std::string size = "1024x768";
  std::string eye, target, up;
  double fov_deg = 35.0;
  std::uint32_t width = 0, height = 0;  // of size, after check()

  // Fails (usage) naming the option. Call before anything long.
  Result<void> check();
  // As asked, or such that all of the mesh is seen. Fails as check_camera. Precondition: check() succeeded.
  Result<Camera> camera(const std::vector<glm::dvec3>& positions) const;

 private:
  std::optional<glm::dvec3> eye_, target_, up_;
};
void add_camera_arguments(CLI::App& command, CameraArguments& arguments, const std::string& size_help);

}  // namespace fanstream
