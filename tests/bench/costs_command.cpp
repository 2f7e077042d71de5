#include <fmt/format.h>

#include <memory>
#include <set>

#include "tests/bench/bench_command.h"
#include "tests/bench/cost_figures.h"
#include "tests/bench/machine.h"

namespace fanstream::bench {
namespace {

struct Arguments {
  std::vector<std::string> files, costs;
  CostTableOptions options;
  FormatArguments format;
};

int run(Arguments& arguments, const std::string& command_line) {
  CostTableOptions& options = arguments.options;
  options.costs = all_costs();
  std::set<CostKind> wanted;
  for (const std::string& name : arguments.costs) {
    const Result<CostKind> cost = cost_of_name(name);
    if (!cost) return report_error(cost.error());
    wanted.insert(*cost);
  }
  if (!wanted.empty()) std::erase_if(options.costs, [&](const CostOptions& c) { return !wanted.contains(c.cost); });
  const std::string machine = describe_machine();
  std::vector<std::vector<CostFigures>> by_file;
  const int code = measure_each<std::vector<CostFigures>>(arguments.files, options, measure_costs, by_file);
  std::vector<CostFigures> figures;
  for (auto& of_file : by_file) figures.insert(figures.end(), of_file.begin(), of_file.end());
  fmt::print("{}", print_sections(cost_sections(figures, options), {machine, command_line}, arguments.format.format()));
  return code;
}

}  // namespace

BenchCommand add_costs_command(CLI::App& app) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("costs", "Builds with every cost and placement: sizes and errors side by side");
  command->add_option("files", arguments->files, "PLY, STL, OBJ, OFF, glTF or GLB files")->required();
  command->add_option("--position-bits", arguments->options.position_bits, "Bits of the grid along the longest side")
      ->capture_default_str()
      ->check(CLI::Range(kLeastPositionBits, kMostPositionBits));
  command->add_option("--costs", arguments->costs, "Only those costs (fans, quadric, curvature; all)")->delimiter(',');
  arguments->format.add_to(*command);
  command->footer("Example:\n  fanstream-bench costs ../shared/data/cow_2904v.off --costs quadric,curvature");
  return {command, [arguments](const std::string& command_line) { return run(*arguments, command_line); }};
}

}  // namespace fanstream::bench
