// The commands of fanstream-bench. Each adds itself to the command line and returns what runs it; a run returns the
// process's exit code, having said on standard error what went wrong.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

#include "common/support/result.h"
#include "tests/bench/report.h"

namespace fanstream::bench {

struct BenchCommand {
  CLI::App* app = nullptr;  // whether it was chosen: app->parsed()
  // `command_line`: the words the process was started with, for the head of a report.
  std::function<int(const std::string& command_line)> run;
};

BenchCommand add_models_command(CLI::App& app);
BenchCommand add_views_command(CLI::App& app);
BenchCommand add_costs_command(CLI::App& app);
BenchCommand add_papers_command(CLI::App& app);
BenchCommand add_train_command(CLI::App& app);
BenchCommand add_load_command(CLI::App& app);

// On standard error. Returns the exit code of the error.
int report_error(const Error& error);
// A line of progress, on standard error.
void say(const std::string& line);

struct FormatArguments {
  bool json = false, markdown = false;
  void add_to(CLI::App& command);
  ReportFormat format() const;
};

// Measures the files one after another, naming each in the lines of progress. Goes on after a failure: the others are
// worth having all the same. Returns the exit code.
template <class Figures, class Options, class Measure>
int measure_each(const std::vector<std::string>& files, Options& options, Measure measure,
                 std::vector<Figures>& figures) {
  int code = 0;
  for (std::size_t i = 0; i < files.size(); ++i) {
    options.progress = [&](std::string_view stage) {
      say("[" + std::to_string(i + 1) + "/" + std::to_string(files.size()) + "] " + files[i] + ": " +
          std::string(stage));
    };
    Result<Figures> measured = measure(files[i], options);
    if (measured) {
      figures.push_back(std::move(*measured));
    } else {
      code = report_error(measured.error());
    }
  }
  return code;
}

}  // namespace fanstream::bench
