#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <set>

#include "tests/bench/bench_command.h"
#include "tests/bench/machine.h"
#include "tests/bench/papers/papers_report.h"

namespace fanstream::bench {
namespace {

struct Arguments {
  std::string models = "../shared/data";
  std::string pictures;
  std::vector<std::string> parts;
  FormatArguments format;
  bool quick = false;
};

int run(const Arguments& arguments, const std::string& command_line) {
  std::vector<PapersPart> parts;
  for (const PapersPart& part : papers_parts()) {
    const bool wanted = std::find(arguments.parts.begin(), arguments.parts.end(), part.name) != arguments.parts.end();
    if (wanted || arguments.parts.empty()) parts.push_back(part);
  }
  PapersOptions options{arguments.models, arguments.pictures, arguments.quick,
                        [](std::string_view stage) { say(std::string(stage)); }};
  const std::string machine = describe_machine();
  const Result<PapersFigures> figures = measure_papers(parts, options);
  if (!figures) return report_error(figures.error());
  fmt::print("{}", print_sections(figures->sections, {machine, command_line}, arguments.format.format()));
  if (!figures->sections.empty()) say(fmt::format("pictures in {}", arguments.pictures));
  int code = 0;
  for (const Error& failure : figures->failures) {
    const int exit = report_error(failure);
    if (code == 0) code = exit;
  }
  return code;
}

}  // namespace

BenchCommand add_papers_command(CLI::App& app) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("papers", "Makes the source documents' tables again, with ours beside them, and pictures");
  command->add_option("--models", arguments->models, "The folder that holds the meshes")->capture_default_str();
  command->add_option("-o,--output", arguments->pictures, "The folder that pictures go to; made if missing")
      ->required();
  std::set<std::string> names;
  for (const PapersPart& part : papers_parts()) names.insert(std::string(part.name));
  command->add_option("--parts", arguments->parts, "Which documents (all)")
      ->delimiter(',')
      ->check(CLI::IsMember(names));
  arguments->format.add_to(*command);
  command->add_flag("--quick", arguments->quick, "Fewer repetitions and samples: for a look, not for a record");
  command->footer("Example:\n  fanstream-bench papers --models ../shared/data -o papers/ --parts fans");
  return {command, [arguments](const std::string& command_line) { return run(*arguments, command_line); }};
}

}  // namespace fanstream::bench
