#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <set>

#include "tests/bench/bench_command.h"
#include "tests/bench/machine.h"
#include "tests/bench/views_report.h"

namespace fanstream::bench {
namespace {

// In the order of ViewsPart.
constexpr std::array<const char*, kAllViewsParts.size()> kPartNames{"bytes", "peers", "forced", "link",
                                                                    "rates", "moves", "memory", "planner"};

struct Arguments {
  std::vector<std::string> files, parts;
  ViewsOptions options;
  FormatArguments format;
  int position_bits = 0;
  bool quick = false;
};

int run(Arguments& arguments, const std::string& command_line) {
  ViewsOptions& options = arguments.options;
  const std::vector<std::string>& parts = arguments.parts;
  if (arguments.position_bits != 0) options.position_bits = arguments.position_bits;
  if (!parts.empty()) options.parts.clear();
  for (std::size_t i = 0; i < kPartNames.size(); ++i) {
    if (std::find(parts.begin(), parts.end(), kPartNames[i]) != parts.end()) {
      options.parts.push_back(kAllViewsParts[i]);
    }
  }
  if (arguments.quick) {
    options.repetitions = 1;
    options.disc_seeds = 4;
    options.face_samples = 30'000;
  }
  const std::string machine = describe_machine();
  std::vector<ViewsFigures> figures;
  const int code = measure_each<ViewsFigures>(arguments.files, options, measure_views, figures);
  fmt::print("{}", print_views(figures, {machine, command_line}, arguments.format.format()));
  return code;
}

}  // namespace

BenchCommand add_views_command(CLI::App& app) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("views", "Measures what views of models take, beside Draco");
  command->add_option("file", arguments->files, "PLY, STL, OBJ, OFF, glTF or GLB files")->required();
  command
      ->add_option("--position-bits", arguments->position_bits,
                   "Bits of the grid along the longest side (the builder's choice)")
      ->check(CLI::Range(kLeastPositionBits, kMostPositionBits));
  command->add_option("--parts", arguments->parts, "What to measure (everything)")
      ->delimiter(',')
      ->check(CLI::IsMember(std::set<std::string>(kPartNames.begin(), kPartNames.end())));
  arguments->format.add_to(*command);
  command->add_flag("--quick", arguments->quick, "Fewer repetitions, discs and samples: for a look, not for a record");
  command->footer(
      "Example:\n  fanstream-bench views ../shared/data/armadillo_86k.ply --quick\n"
      "  fanstream-bench views ../shared/data/stanford_bunny_zipper.ply --position-bits 12 --parts rates");
  return {command, [arguments](const std::string& command_line) { return run(*arguments, command_line); }};
}

}  // namespace fanstream::bench
