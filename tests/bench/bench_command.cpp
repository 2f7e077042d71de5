#include "tests/bench/bench_command.h"

#include <fmt/format.h>

namespace fanstream::bench {

int report_error(const Error& error) {
  fmt::print(stderr, "fanstream-bench: {}\n", error.message);
  return exit_code(error.kind);
}

void say(const std::string& line) {
  fmt::print(stderr, "{}\n", line);
  std::fflush(stderr);
}

void FormatArguments::add_to(CLI::App& command) {
  CLI::Option* as_json = command.add_flag("--json", json, "Print JSON");
  command.add_flag("--markdown", markdown, "Print Markdown tables")->excludes(as_json);
}

ReportFormat FormatArguments::format() const {
  return json ? ReportFormat::json : markdown ? ReportFormat::markdown : ReportFormat::text;
}

}  // namespace fanstream::bench
