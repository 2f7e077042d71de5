#include <fmt/format.h>

#include <memory>

#include "tests/bench/bench_command.h"
#include "tests/bench/machine.h"
#include "tests/bench/model_report.h"

namespace fanstream::bench {
namespace {

struct Arguments {
  std::vector<std::string> files;
  MeasureOptions options;
  FormatArguments format;
  bool quick = false;
};

int run(Arguments& arguments, const std::string& command_line) {
  if (arguments.quick) {
    arguments.options.repetitions = 1;
    arguments.options.disc_seeds = 4;
    arguments.options.face_samples = 30'000;
  }
  const std::string machine = describe_machine();
  std::vector<ModelFigures> figures;
  const int code = measure_each<ModelFigures>(arguments.files, arguments.options, measure_model, figures);
  fmt::print("{}", print_report(figures, {machine, command_line}, arguments.format.format()));
  return code;
}

}  // namespace

BenchCommand add_models_command(CLI::App& app) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("models", "Measures models beside Draco and meshoptimizer");
  command->add_option("files", arguments->files, "PLY, STL, OBJ, OFF, glTF or GLB files")->required();
  command->add_option("--position-bits", arguments->options.position_bits, "Bits of the grid along the longest side")
      ->capture_default_str()
      ->check(CLI::Range(kLeastPositionBits, kMostPositionBits));
  arguments->format.add_to(*command);
  command->add_flag("--quick", arguments->quick, "Fewer repetitions, discs and samples: for a look, not for a record");
  command->footer("Example:\n  fanstream-bench models ../shared/data/*.ply --markdown >> tests/bench/RESULTS.md");
  return {command, [arguments](const std::string& command_line) { return run(*arguments, command_line); }};
}

}  // namespace fanstream::bench
