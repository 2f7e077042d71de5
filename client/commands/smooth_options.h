// The options of commands that draw a mesh past its finest level.
#pragma once

#include <CLI/CLI.hpp>

#include "client/commands/output.h"
#include "client/smooth/smooth_silhouette.h"

namespace fanstream {

struct SmoothArguments {
  bool smooth = false;
  double crease_angle_deg = SmoothOptions{}.crease_angle_deg;

  // With the commands' stop signal.
  SmoothOptions options() const;
};
void add_smooth_arguments(CLI::App& command, SmoothArguments& arguments);

Json json_of(const SmoothReport& report);
// "smoothed    ..." with its line end.
std::string text_of(const SmoothReport& report);

}  // namespace fanstream
