// fanstream-bench: sizes, shapes and speeds beside other programs' in one run; what views take; training; load.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <set>

#include "common/import/mesh_cleaner.h"
#include "common/import/mesh_import.h"
#include "tests/bench/cost_figures.h"
#include "tests/bench/load_measure.h"
#include "tests/bench/machine.h"
#include "tests/bench/model_report.h"
#include "tests/bench/train_statistics.h"
#include "tests/bench/views_report.h"

namespace {

using namespace fanstream;
using namespace fanstream::bench;

std::string command_line;

int tell(const Error& error) {
  fmt::print(stderr, "fanstream-bench: {}\n", error.message);
  return exit_code(error.kind);
}

void say(const std::string& line) {
  fmt::print(stderr, "{}\n", line);
  std::fflush(stderr);
}

Result<TriangleMesh> cleaned(const std::string& file) {
  Result<ImportedMesh> imported = import_mesh(file);
  if (!imported) return tl::unexpected(imported.error());
  TriangleMesh mesh = clean_mesh(std::move(imported->mesh)).mesh;
  if (mesh.triangles.empty()) return fail(ErrorKind::bad_input, file + ": no triangles left after cleaning");
  return mesh;
}

ReportFormat report_format(bool json, bool markdown) {
  return json ? ReportFormat::json : markdown ? ReportFormat::markdown : ReportFormat::text;
}

// Goes on after a failure: the others are worth having all the same. Returns the exit code.
template <class Figures, class Options, class Measure>
int measure_each(const std::vector<std::string>& files, Options& options, Measure measure,
                 std::vector<Figures>& figures) {
  int code = 0;
  for (std::size_t i = 0; i < files.size(); ++i) {
    options.progress = [&](std::string_view stage) {
      say(fmt::format("[{}/{}] {}: {}", i + 1, files.size(), files[i], stage));
    };
    Result<Figures> measured = measure(files[i], options);
    if (measured) {
      figures.push_back(std::move(*measured));
    } else {
      code = tell(measured.error());
    }
  }
  return code;
}

struct ModelsCommand {
  std::vector<std::string> files;
  MeasureOptions options;
  bool json = false, markdown = false, quick = false;

  void add_to(CLI::App& app) {
    CLI::App* command = app.add_subcommand("models", "Measures models beside Draco and meshoptimizer");
    command->add_option("files", files, "PLY, STL, OBJ, OFF, glTF or GLB files")->required();
    command->add_option("--position-bits", options.position_bits, "Bits of the grid along the longest side")
        ->capture_default_str()
        ->check(CLI::Range(kLeastPositionBits, kMostPositionBits));
    CLI::Option* as_json = command->add_flag("--json", json, "Print JSON");
    command->add_flag("--markdown", markdown, "Print Markdown tables")->excludes(as_json);
    command->add_flag("--quick", quick, "Fewer repetitions, discs and samples: for a look, not for a record");
    command->footer("Example:\n  fanstream-bench models ../shared/data/*.ply --markdown >> tests/bench/RESULTS.md");
  }

  int run() {
    if (quick) {
      options.repetitions = 1;
      options.disc_seeds = 4;
      options.face_samples = 30'000;
    }
    const std::string machine = describe_machine();
    std::vector<ModelFigures> figures;
    const int code = measure_each<ModelFigures>(files, options, measure_model, figures);
    fmt::print("{}", print_report(figures, {machine, command_line}, report_format(json, markdown)));
    return code;
  }
};

// In the order of ViewsPart.
constexpr std::array<const char*, kAllViewsParts.size()> kViewsPartNames{"bytes", "forced", "link",   "rates",
                                                                         "moves", "memory", "planner"};

struct ViewsCommand {
  std::vector<std::string> files, parts;
  ViewsOptions options;
  int position_bits = 0;
  bool json = false, markdown = false, quick = false;

  void add_to(CLI::App& app) {
    CLI::App* command = app.add_subcommand("views", "Measures what views of models take, beside Draco");
    command->add_option("file", files, "PLY, STL, OBJ, OFF, glTF or GLB files")->required();
    command
        ->add_option("--position-bits", position_bits, "Bits of the grid along the longest side (the builder's choice)")
        ->check(CLI::Range(kLeastPositionBits, kMostPositionBits));
    command->add_option("--parts", parts, "What to measure (everything)")
        ->delimiter(',')
        ->check(CLI::IsMember(std::set<std::string>(kViewsPartNames.begin(), kViewsPartNames.end())));
    CLI::Option* as_json = command->add_flag("--json", json, "Print JSON");
    command->add_flag("--markdown", markdown, "Print Markdown tables")->excludes(as_json);
    command->add_flag("--quick", quick, "Fewer repetitions, discs and samples: for a look, not for a record");
    command->footer(
        "Example:\n  fanstream-bench views ../shared/data/armadillo_86k.ply --quick\n"
        "  fanstream-bench views ../shared/data/stanford_bunny_zipper.ply --position-bits 12 --parts rates");
  }

  int run() {
    if (position_bits != 0) options.position_bits = position_bits;
    if (!parts.empty()) options.parts.clear();
    for (std::size_t i = 0; i < kViewsPartNames.size(); ++i) {
      if (std::find(parts.begin(), parts.end(), kViewsPartNames[i]) != parts.end()) {
        options.parts.push_back(kAllViewsParts[i]);
      }
    }
    if (quick) {
      options.repetitions = 1;
      options.disc_seeds = 4;
      options.face_samples = 30'000;
    }
    const std::string machine = describe_machine();
    std::vector<ViewsFigures> figures;
    const int code = measure_each<ViewsFigures>(files, options, measure_views, figures);
    fmt::print("{}", print_views(figures, {machine, command_line}, report_format(json, markdown)));
    return code;
  }
};

struct CostsCommand {
  std::vector<std::string> files, costs;
  CostTableOptions options;
  bool json = false, markdown = false;

  void add_to(CLI::App& app) {
    CLI::App* command = app.add_subcommand("costs", "Builds with every cost and placement: sizes and errors side by side");
    command->add_option("files", files, "PLY, STL, OBJ, OFF, glTF or GLB files")->required();
    command->add_option("--position-bits", options.position_bits, "Bits of the grid along the longest side")
        ->capture_default_str()
        ->check(CLI::Range(kLeastPositionBits, kMostPositionBits));
    command->add_option("--costs", costs, "Only those costs (fans, quadric, curvature; all)")->delimiter(',');
    CLI::Option* as_json = command->add_flag("--json", json, "Print JSON");
    command->add_flag("--markdown", markdown, "Print Markdown tables")->excludes(as_json);
    command->footer("Example:\n  fanstream-bench costs ../shared/data/cow_2904v.off --costs quadric,curvature");
  }

  int run() {
    options.costs = all_costs();
    std::set<CostKind> wanted;
    for (const std::string& name : costs) {
      const Result<CostKind> cost = cost_of_name(name);
      if (!cost) return tell(cost.error());
      wanted.insert(*cost);
    }
    if (!wanted.empty()) std::erase_if(options.costs, [&](const CostOptions& c) { return !wanted.contains(c.cost); });
    const std::string machine = describe_machine();
    std::vector<std::vector<CostFigures>> by_file;
    const int code = measure_each<std::vector<CostFigures>>(files, options, measure_costs, by_file);
    std::vector<CostFigures> figures;
    for (auto& of_file : by_file) figures.insert(figures.end(), of_file.begin(), of_file.end());
    fmt::print("{}", print_sections(cost_sections(figures, options), {machine, command_line},
                                    report_format(json, markdown)));
    return code;
  }
};

struct TrainCommand {
  std::vector<std::string> files;
  std::vector<int> bits{11, 12, 14};

  void add_to(CLI::App& app) {
    CLI::App* command = app.add_subcommand("train", "Learns the coder's built-in statistics and prints their source");
    command->add_option("files", files, "The corpus")->required();
    command->add_option("--position-bits", bits, "Grids to look at each model on")
        ->delimiter(',')
        ->capture_default_str()
        ->check(CLI::Range(kLeastPositionBits, kMostPositionBits));
    command->footer(
        "Prints what common/coding/default_statistics.inc holds. Old assets were coded with the old statistics: a new "
        "version of the format goes with them.\n\n"
        "Example:\n  fanstream-bench train ../shared/data/*.ply --position-bits 11,12,14 > new_statistics.inc");
  }

  int run() {
    StatisticsTraining training;
    for (std::size_t i = 0; i < files.size(); ++i) {
      const Result<TriangleMesh> mesh = cleaned(files[i]);
      if (!mesh) return tell(mesh.error());
      for (const int b : bits) {
        say(fmt::format("[{}/{}] {}: {} bits", i + 1, files.size(), files[i], b));
        if (const Result<void> added = training.add(*mesh, b); !added)
          return tell(with_context(added.error(), files[i]));
      }
    }
    fmt::print("{}", statistics_source(training.learn(),
                                       fmt::format("Learnt from {} models at {} bits by fanstream-bench train.",
                                                   files.size(), fmt::join(bits, ", "))));
    return 0;
  }
};

struct LoadCommand {
  std::string file;
  std::uint32_t clients = 200;
  int position_bits = 12;
  bool json = false;

  void add_to(CLI::App& app) {
    CLI::App* command =
        app.add_subcommand("load", "Lets many clients fetch one model at once from a server in this process");
    command->add_option("file", file, "A mesh file")->required();
    command->add_option("-c,--clients", clients, "How many clients")
        ->capture_default_str()
        ->check(CLI::Range(1U, 100'000U));
    command->add_option("--position-bits", position_bits, "Bits of the grid along the longest side")
        ->capture_default_str()
        ->check(CLI::Range(kLeastPositionBits, kMostPositionBits));
    command->add_flag("--json", json, "Print JSON");
    command->footer("Example:\n  fanstream-bench load ../shared/data/stanford_bunny_zipper.ply --clients 200");
  }

  int run() const {
    const Result<TriangleMesh> mesh = cleaned(file);
    if (!mesh) return tell(mesh.error());
    BuildOptions options;
    options.position_bits = position_bits;
    Result<BuiltAsset> built = build_asset(*mesh, options);
    if (!built) return tell(with_context(built.error(), file));
    const std::size_t asset_bytes = built->bytes.size();
    const Result<std::shared_ptr<const OpenAsset>> asset = OpenAsset::open(std::move(built->bytes), file);
    if (!asset) return tell(asset.error());
    const std::string machine = describe_machine();
    const Result<LoadMeasurement> measured = measure_load(*asset, clients);
    if (!measured) return tell(measured.error());
    print(machine, asset_bytes, *measured);
    if (measured->report.first_failure) return tell(*measured->report.first_failure);
    if (!measured->exact) return tell({ErrorKind::bad_input, file + ": what clients received is not the asset"});
    return 0;
  }

  void print(const std::string& machine, std::size_t asset_bytes, const LoadMeasurement& measured) const {
    const LoadReport& report = measured.report;
    if (json) {
      const auto spread = [](const Spread& s) {
        return nlohmann::ordered_json{{"min", s.min}, {"median", s.median}, {"p95", s.p95}, {"max", s.max}};
      };
      const nlohmann::ordered_json out = {{"machine", machine},
                                          {"command", command_line},
                                          {"clients", report.clients},
                                          {"complete", report.complete},
                                          {"exact", measured.exact},
                                          {"asset_bytes", asset_bytes},
                                          {"received_bytes", report.bytes},
                                          {"seconds", report.seconds},
                                          {"head_ms", spread(report.head_ms)},
                                          {"complete_ms", spread(report.complete_ms)}};
      fmt::print("{}\n", out.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
      return;
    }
    fmt::print("{}\n{}\n\n", machine, command_line);
    fmt::print("{} of {} clients complete, {}; {:.1f} MB each, {:.1f} MB in {:.2f} s\n", report.complete,
               report.clients, measured.exact ? "all exact" : "NOT EXACT", static_cast<double>(asset_bytes) * 1e-6,
               static_cast<double>(report.bytes) * 1e-6, report.seconds);
    const auto line = [](const char* what, const Spread& s) {
      fmt::print("{:<10} median {:.0f} ms, 95 % {:.0f} ms, max {:.0f} ms\n", what, s.median, s.p95, s.max);
    };
    line("FM0", report.head_ms);
    line("complete", report.complete_ms);
  }
};

}  // namespace

int main(int argc, char** argv) {
  command_line = "fanstream-bench";
  for (int i = 1; i < argc; ++i) command_line += std::string(" ") + argv[i];
  CLI::App app("Measures Fanstream beside other programs, on the same models and grid, in one run.");
  app.require_subcommand(1);
  app.footer(
      "Example:\n  fanstream-bench models ../shared/data/stanford_bunny_zipper.ply --quick\n\n"
      "'fanstream-bench COMMAND --help' tells more. Exit codes: 0 measured, 2 usage, 3 no such file, 5 bad input or a "
      "result that is not exact, 7 limit, 8 network.");
  ModelsCommand models;
  ViewsCommand views;
  CostsCommand costs;
  TrainCommand train;
  LoadCommand load;
  models.add_to(app);
  views.add_to(app);
  costs.add_to(app);
  train.add_to(app);
  load.add_to(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const int code = app.exit(error);
    return code == 0 ? 0 : exit_code(ErrorKind::usage);
  }
  if (app.got_subcommand("models")) return models.run();
  if (app.got_subcommand("views")) return views.run();
  if (app.got_subcommand("costs")) return costs.run();
  return app.got_subcommand("train") ? train.run() : load.run();
}
