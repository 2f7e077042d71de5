#include <fmt/format.h>

#include <chrono>
#include <ctime>
#include <filesystem>
#include <set>

#include "common/grid/position_grid.h"
#include "common/support/atomic_file.h"
#include "common/support/progress_bar.h"
#include "server/commands/commands.h"
#include "server/commands/output.h"
#include "server/store/model_build.h"

namespace fanstream {
namespace {

namespace fs = std::filesystem;

struct BuildArguments {
  std::vector<std::string> inputs;
  std::string output;
  std::optional<int> position_bits;
  std::optional<std::uint32_t> base_vertices;
  std::string cost, placement, curvature, quadrics, valences;  // names; empty: the default
  CostOptions cost_options;
  bool json = false;
};

// Names to choices, whatever they are.
Result<void> choose_cost(BuildArguments& arguments) {
  CostOptions& options = arguments.cost_options;
  const auto choose = [](const std::string& name, auto find, auto& choice) -> Result<void> {
    if (name.empty()) return {};
    const auto found = find(name);
    if (!found) return tl::unexpected(found.error());
    choice = *found;
    return {};
  };
  if (Result<void> found = choose(arguments.cost, cost_of_name, options.cost); !found) return found;
  if (Result<void> found = choose(arguments.placement, placement_of_name, options.placement); !found) return found;
  if (Result<void> found = choose(arguments.curvature, curvature_of_name, options.curvature); !found) return found;
  if (Result<void> found = choose(arguments.quadrics, quadrics_of_name, options.quadrics); !found) return found;
  if (Result<void> found = choose(arguments.valences, valences_of_name, options.valences); !found) return found;
  return check_cost_options(options);
}

// Where each input's asset goes. Into a folder if the output is one, ends in a slash, or is for several inputs.
Result<std::vector<fs::path>> output_paths(const BuildArguments& arguments) {
  const fs::path output(arguments.output);
  std::error_code error;
  const bool exists_as_folder = fs::is_directory(output, error);
  if (!exists_as_folder && arguments.inputs.size() == 1 && output.has_filename()) return std::vector<fs::path>{output};
  if (!exists_as_folder && fs::exists(output, error)) {
    return fail(ErrorKind::usage, output.string() + ": is a file; several assets need a folder (-o DIR)");
  }
  fs::create_directories(output, error);
  if (error) return fail(ErrorKind::io, output.string() + ": cannot make this folder: " + error.message());
  std::vector<fs::path> paths;
  std::set<fs::path> taken;
  for (const std::string& input : arguments.inputs) {
    paths.push_back(output / (fs::path(input).stem().string() + ".fan"));
    if (!taken.insert(paths.back()).second) {
      return fail(ErrorKind::usage,
                  input + ": another input would also become " + paths.back().string() + "; build it by itself");
    }
  }
  return paths;
}

struct OneBuild {
  BuildReport report;
  RepairReport repairs;
  Digest digest{};
  double seconds = 0;
  double cpu_seconds = 0;  // of all threads: what a busy machine does not change
};

Result<OneBuild> build_one(const std::string& input, const fs::path& output, const BuildArguments& arguments) {
  std::error_code error;
  if (fs::equivalent(input, output, error)) {
    return fail(ErrorKind::usage, input + ": is the output too; the model would be lost. Choose another -o");
  }
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t cpu_start = std::clock();
  ProgressBar bar(fs::path(input).filename().string());
  BuildOptions options;
  options.position_bits = arguments.position_bits;
  options.base_vertices = arguments.base_vertices;
  options.cost = arguments.cost_options;
  options.progress = [&](std::string_view stage, double fraction) {
    bar.update(stage, overall_fraction(stage, fraction));
  };
  Result<ModelBuild> built = build_model(input, options);
  bar.finish();
  if (!built) return tl::unexpected(built.error());
  for (const std::string& warning : built->warnings) fmt::print(stderr, "fanstream-server: note: {}\n", warning);
  const std::span<const std::byte> bytes(built->asset.bytes);
  if (Result<void> written = write_file_atomically(output, bytes); !written) return tl::unexpected(written.error());
  Result<AssetPreamble> preamble = read_preamble(bytes, output.string());
  if (!preamble) return tl::unexpected(preamble.error());
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  const double cpu_seconds = static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC;
  return OneBuild{built->asset.report, built->repairs, preamble->digest, seconds.count(), cpu_seconds};
}

Json json_of(const OneBuild& build, const std::string& input, const fs::path& output, const CostOptions& cost) {
  Json json = {{"input", input}, {"output", output.string()}, {"digest", text_of(build.digest)}};
  json["cost"] = name_of(cost.cost);
  json["placement"] = name_of(cost.placement);
  json.update(fanstream::json_of(build.report));
  Json repairs = Json::object();
  for (const auto& [name, count] : named_counts(build.repairs)) repairs[name] = count;
  json["repairs"] = repairs;
  json["build_seconds"] = build.seconds;
  json["cpu_seconds"] = build.cpu_seconds;
  json["peak_memory_bytes"] = peak_memory_bytes();
  return json;
}

void print_text(const OneBuild& build, const std::string& input, const fs::path& output) {
  fmt::print("{} -> {}\n{}", input, output.string(), summary_of(build.report, build.digest));
  std::string repairs;
  for (const auto& [name, count] : named_counts(build.repairs)) {
    if (count == 0) continue;
    std::string words = name;
    std::replace(words.begin(), words.end(), '_', ' ');
    const std::string item = fmt::format("{} {}", grouped(count), words);
    const std::size_t line = repairs.size() - (repairs.rfind('\n') + 1);
    repairs += repairs.empty() ? "" : line + item.size() > 64 ? ",\n           " : ", ";
    repairs += item;
  }
  fmt::print("  repairs  {}\n", repairs.empty() ? "none" : repairs);
  fmt::print("  built in {:.2f} s, {:.3f} million triangles/s, at most {} MB of memory\n", build.seconds,
             build.report.triangles * 1e-6 / build.seconds, peak_memory_bytes() / 1'000'000);
}

// One bad input does not keep the others from being built; the exit code is that of the first failure.
int run(BuildArguments& arguments) {
  if (const Result<void> chosen = choose_cost(arguments); !chosen) return report_error(chosen.error());
  const Result<std::vector<fs::path>> outputs = output_paths(arguments);
  if (!outputs) return report_error(outputs.error());
  int exit = 0;
  Json all = Json::array();
  for (std::size_t i = 0; i < arguments.inputs.size(); ++i) {
    const std::string& input = arguments.inputs[i];
    const fs::path& output = (*outputs)[i];
    const Result<OneBuild> built = build_one(input, output, arguments);
    if (!built) {
      const int code = report_error(built.error());
      if (exit == 0) exit = code;
      continue;
    }
    if (arguments.json) {
      all.push_back(json_of(*built, input, output, arguments.cost_options));
    } else {
      print_text(*built, input, output);
    }
  }
  int printed = 0;
  if (!arguments.json) {
    printed = flush_output();
  } else if (arguments.inputs.size() > 1 || !all.empty()) {
    printed = print_json(arguments.inputs.size() == 1 ? all[0] : all);
  }
  return exit != 0 ? exit : printed;
}

}  // namespace

Command add_build_command(CLI::App& app) {
  CLI::App* build = app.add_subcommand("build", "Turns models into assets");
  auto arguments = std::make_shared<BuildArguments>();
  build->add_option("INPUT", arguments->inputs, "glTF, GLB, OBJ, PLY, STL or OFF files")->required();
  build->add_option("-o,--output", arguments->output, "Asset file, or a folder for NAME.fan of each input")->required();
  build->add_option("--position-bits", arguments->position_bits, "Of the grid along the longest side; default below")
      ->check(CLI::Range(kLeastPositionBits, kMostPositionBits));
  build->add_option("--base-vertices", arguments->base_vertices, "Of the coarsest level, where it can be reached")
      ->check(CLI::Range(4U, 1U << 24U));
  build->add_option("--cost", arguments->cost, "What orders the merges: fans, quadric (default) or curvature");
  build->add_option("--placement", arguments->placement,
                    "Where merged vertices go: ends+middle (default), end, segment or optimal");
  build->add_option("--quadrics", arguments->quadrics,
                    "Of costs quadric and curvature: memoryless (default) or accumulated");
  build->add_option("--curvature", arguments->curvature, "Of cost curvature: mean (default), gaussian or principal");
  build->add_option(
      "--valences", arguments->valences,
      "What goes first of merges of like cost: regular (those that leave regular valences; default of cost "
      "quadric) or any");
  build->add_option("--kappa", arguments->cost_options.kappa,
                    fmt::format("Of cost fans: stiffness of the springs ({})", CostOptions::kUsualKappa));
  build->add_option("--samples", arguments->cost_options.samples,
                    "Of cost fans: points on the surface to keep close to, besides all vertices (0)");
  build->add_flag("--json", arguments->json, "Print the report as JSON (of several: an array)");
  build->footer(
      "The default grid has steps of a 24th of the mean edge, within 10 to 16 bits.\n"
      "Examples:\n"
      "  fanstream-server build bunny.ply -o bunny.fan\n"
      "  fanstream-server build scans/*.ply -o assets/ --position-bits 14 --json\n"
      "  fanstream-server build cow.off -o cow.fan --cost curvature --curvature principal --placement optimal");
  return {build, [arguments] { return run(*arguments); }};
}

}  // namespace fanstream
