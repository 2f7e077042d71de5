#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "server/build/asset_builder.h"
#include "tests/bench/bench_command.h"
#include "tests/bench/cleaned_mesh.h"
#include "tests/bench/load_measure.h"
#include "tests/bench/machine.h"

namespace fanstream::bench {
namespace {

struct Arguments {
  std::string file;
  std::uint32_t clients = 200;
  int position_bits = 12;
  bool json = false;
};

struct Outcome {
  std::string machine, command_line;
  std::size_t asset_bytes = 0;
  LoadMeasurement measured;
};

void print_json(const Outcome& outcome) {
  const LoadReport& report = outcome.measured.report;
  const auto spread = [](const Spread& s) {
    return nlohmann::ordered_json{{"min", s.min}, {"median", s.median}, {"p95", s.p95}, {"max", s.max}};
  };
  const nlohmann::ordered_json out = {{"machine", outcome.machine},        {"command", outcome.command_line},
                                      {"clients", report.clients},         {"complete", report.complete},
                                      {"exact", outcome.measured.exact},   {"asset_bytes", outcome.asset_bytes},
                                      {"received_bytes", report.bytes},    {"seconds", report.seconds},
                                      {"head_ms", spread(report.head_ms)}, {"complete_ms", spread(report.complete_ms)}};
  fmt::print("{}\n", out.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

void print_text(const Outcome& outcome) {
  const LoadReport& report = outcome.measured.report;
  fmt::print("{}\n{}\n\n", outcome.machine, outcome.command_line);
  fmt::print("{} of {} clients complete, {}; {:.1f} MB each, {:.1f} MB in {:.2f} s\n", report.complete, report.clients,
             outcome.measured.exact ? "all exact" : "NOT EXACT", static_cast<double>(outcome.asset_bytes) * 1e-6,
             static_cast<double>(report.bytes) * 1e-6, report.seconds);
  const auto line = [](const char* what, const Spread& s) {
    fmt::print("{:<10} median {:.0f} ms, 95 % {:.0f} ms, max {:.0f} ms\n", what, s.median, s.p95, s.max);
  };
  line("FM0", report.head_ms);
  line("complete", report.complete_ms);
}

int run(const Arguments& arguments, const std::string& command_line) {
  const std::string& file = arguments.file;
  const Result<TriangleMesh> mesh = cleaned_mesh(file);
  if (!mesh) return report_error(mesh.error());
  BuildOptions options;
  options.position_bits = arguments.position_bits;
  Result<BuiltAsset> built = build_asset(*mesh, options);
  if (!built) return report_error(with_context(built.error(), file));
  Outcome outcome{describe_machine(), command_line, built->bytes.size(), {}};
  const Result<std::shared_ptr<const OpenAsset>> asset = OpenAsset::open(std::move(built->bytes), file);
  if (!asset) return report_error(asset.error());
  Result<LoadMeasurement> measured = measure_load(*asset, arguments.clients);
  if (!measured) return report_error(measured.error());
  outcome.measured = std::move(*measured);
  arguments.json ? print_json(outcome) : print_text(outcome);
  if (outcome.measured.report.first_failure) return report_error(*outcome.measured.report.first_failure);
  if (!outcome.measured.exact) {
    return report_error({ErrorKind::bad_input, file + ": what clients received is not the asset"});
  }
  return 0;
}

}  // namespace

BenchCommand add_load_command(CLI::App& app) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("load", "Lets many clients fetch one model at once from a server in this process");
  command->add_option("file", arguments->file, "A mesh file")->required();
  command->add_option("-c,--clients", arguments->clients, "How many clients")
      ->capture_default_str()
      ->check(CLI::Range(1U, 100'000U));
  command->add_option("--position-bits", arguments->position_bits, "Bits of the grid along the longest side")
      ->capture_default_str()
      ->check(CLI::Range(kLeastPositionBits, kMostPositionBits));
  command->add_flag("--json", arguments->json, "Print JSON");
  command->footer("Example:\n  fanstream-bench load ../shared/data/stanford_bunny_zipper.ply --clients 200");
  return {command, [arguments](const std::string& command_line) { return run(*arguments, command_line); }};
}

}  // namespace fanstream::bench
