// The commands of fanstream-server. Each adds itself to the command line and returns what runs it; a run returns the
// process's exit code, having said on standard error what went wrong.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace fanstream {

struct Command {
  CLI::App* app = nullptr;  // whether it was chosen: app->parsed()
  std::function<int()> run;
};

Command add_build_command(CLI::App& app);
Command add_inspect_command(CLI::App& app);
Command add_verify_command(CLI::App& app);
Command add_serve_command(CLI::App& app);

}  // namespace fanstream
