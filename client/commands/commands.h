// The commands of fanstream-client. Each adds itself to the command line and returns what runs it; a run returns the
// process's exit code, having said on standard error what went wrong.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace fanstream {

struct Command {
  CLI::App* app = nullptr;  // whether it was chosen: app->parsed()
  std::function<int()> run;
};

Command add_list_command(CLI::App& app);
Command add_fetch_command(CLI::App& app);
Command add_render_command(CLI::App& app);
Command add_snapshots_command(CLI::App& app);
Command add_reduce_command(CLI::App& app);
Command add_subdivide_command(CLI::App& app);
Command add_collide_command(CLI::App& app);

}  // namespace fanstream
