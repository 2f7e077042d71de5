#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>

#include "common/grid/position_grid.h"
#include "tests/bench/bench_command.h"
#include "tests/bench/cleaned_mesh.h"
#include "tests/bench/train_statistics.h"

namespace fanstream::bench {
namespace {

struct Arguments {
  std::vector<std::string> files;
  std::vector<int> bits{11, 12, 14};
};

int run(const Arguments& arguments) {
  const std::vector<std::string>& files = arguments.files;
  StatisticsTraining training;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const Result<TriangleMesh> mesh = cleaned_mesh(files[i]);
    if (!mesh) return report_error(mesh.error());
    for (const int b : arguments.bits) {
      say(fmt::format("[{}/{}] {}: {} bits", i + 1, files.size(), files[i], b));
      if (const Result<void> added = training.add(*mesh, b); !added)
        return report_error(with_context(added.error(), files[i]));
    }
  }
  fmt::print("{}", statistics_source(training.learn(),
                                     fmt::format("Made from a corpus of {} models at {} bits by fanstream-bench train.",
                                                 files.size(), fmt::join(arguments.bits, ", "))));
  return 0;
}

}  // namespace

BenchCommand add_train_command(CLI::App& app) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("train", "Learns the coder's built-in statistics and prints their source");
  command->add_option("files", arguments->files, "The corpus")->required();
  command->add_option("--position-bits", arguments->bits, "Grids to look at each model on")
      ->delimiter(',')
      ->capture_default_str()
      ->check(CLI::Range(kLeastPositionBits, kMostPositionBits));
  command->footer(
      "Prints what common/coding/default_statistics.inc holds. Old assets were coded with the old statistics: a new "
      "version of the format goes with them. Those in use are learnt from 46 meshes of Debian's libcgal-demo and 12 of "
      "../shared/data; learnt without any of the benchmark's eight models, these take up to 0.2 % more.\n\n"
      "Example:\n  fanstream-bench train ../shared/data/*.ply --position-bits 11,12,14 > new_statistics.inc");
  return {command, [arguments](const std::string&) { return run(*arguments); }};
}

}  // namespace fanstream::bench
