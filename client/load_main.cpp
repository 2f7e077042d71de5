// fanstream-load: opens many clients at once against a server and reports rates and latencies.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <nlohmann/json.hpp>

#include "client/load/load_run.h"
#include "common/support/descriptor_limit.h"

namespace {

using namespace fanstream;

std::atomic<bool> stop_requested{false};

void request_stop(int) { stop_requested = true; }

nlohmann::json to_json(const Spread& spread) {
  return {{"min", spread.min}, {"median", spread.median}, {"p95", spread.p95}, {"max", spread.max}};
}

double gigabits_per_second(const LoadReport& report) {
  return report.seconds > 0 ? static_cast<double>(report.bytes) * 8e-9 / report.seconds : 0;
}

void print_json(const LoadOptions& options, const LoadReport& report) {
  nlohmann::json failures = nlohmann::json::object();
  for (const auto& [message, count] : report.failures) failures[message] = count;
  const nlohmann::json json = {{"server", options.address.text()},
                               {"model", options.address.model},
                               {"clients", report.clients},
                               {"complete", report.complete},
                               {"distinct_contents", report.distinct_contents},
                               {"bytes", report.bytes},
                               {"segments", report.segments},
                               {"seconds", report.seconds},
                               {"gigabits_per_second", gigabits_per_second(report)},
                               {"clients_per_second", report.seconds > 0 ? report.complete / report.seconds : 0},
                               {"connected_ms", to_json(report.connected_ms)},
                               {"head_ms", to_json(report.head_ms)},
                               {"complete_ms", to_json(report.complete_ms)},
                               {"failures", failures}};
  fmt::print("{}\n", json.dump(2));
}

void print_text(const LoadReport& report) {
  fmt::print("clients     {} of {} complete, {} distinct content{}\n", report.complete, report.clients,
             report.distinct_contents, report.distinct_contents == 1 ? "" : "s");
  fmt::print("received    {:.1f} MB in {} segments, {:.2f} s, {:.2f} Gbit/s, {:.0f} clients/s\n",
             static_cast<double>(report.bytes) / 1e6, report.segments, report.seconds, gigabits_per_second(report),
             report.seconds > 0 ? report.complete / report.seconds : 0);
  fmt::print("latency ms  {:>9} {:>9} {:>9} {:>9}\n", "min", "median", "p95", "max");
  const auto row = [](const char* label, const Spread& s) {
    fmt::print("  {:<9} {:>9.2f} {:>9.2f} {:>9.2f} {:>9.2f}\n", label, s.min, s.median, s.p95, s.max);
  };
  row("connected", report.connected_ms);
  row("head", report.head_ms);
  row("complete", report.complete_ms);
  for (const auto& [message, count] : report.failures) fmt::print("failed      {} x {}\n", count, message);
}

int outcome(const LoadReport& report) {
  if (report.interrupted) return exit_code(ErrorKind::interrupted);
  if (report.first_failure) {
    fmt::print(stderr, "fanstream-load: {}\n", report.first_failure->message);
    return exit_code(report.first_failure->kind);
  }
  if (report.distinct_contents > 1) {
    fmt::print(stderr, "fanstream-load: clients of the same model received different bytes\n");
    return exit_code(ErrorKind::bad_input);
  }
  return 0;
}

void tell_progress(std::uint32_t clients, std::uint32_t ended, std::uint64_t bytes) {
  const double share = static_cast<double>(ended) / std::max(1U, clients);
  const auto filled = static_cast<std::size_t>(share * 30);
  fmt::print(stderr, "\r[{}{}] {}/{} clients, {:.1f} MB ", std::string(filled, '#'), std::string(30 - filled, '.'),
             ended, clients, static_cast<double>(bytes) / 1e6);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Opens many clients at once against a Fanstream server; each fetches the whole model and checks every byte.");
  app.footer(
      "Example:\n  fanstream-load localhost:7370/bunny --clients 200\n\n"
      "Exit codes: 0 every client complete and equal, 2 usage, 3 unknown model, 5 wrong data, 6 version, 7 limit, 8 "
      "network, 130 stopped.");
  std::string target;
  LoadOptions options;
  double timeout_s = 60;
  bool json = false;
  app.add_option("target", target, "HOST:PORT/MODEL")->required();
  app.add_option("-c,--clients", options.clients, "How many clients")
      ->capture_default_str()
      ->check(CLI::Range(1U, 1'000'000U));
  app.add_option("-t,--threads", options.threads, "Threads of this process; 0: half the cores")
      ->capture_default_str()
      ->check(CLI::Range(0U, 256U));
  app.add_option("--connecting", options.connecting, "At most so many clients connect at the same time")
      ->capture_default_str()
      ->check(CLI::Range(1U, 1'000'000U));
  app.add_option("--timeout", timeout_s, "Seconds for one client to complete")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 1e6));
  app.add_flag("--json", json, "Print the report as JSON");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const int code = app.exit(error);
    return code == 0 ? 0 : exit_code(ErrorKind::usage);
  }
  const Result<ServerAddress> address = parse_server_address(target);
  if (!address || address->model.empty()) {
    fmt::print(stderr, "fanstream-load: {}\n",
               address ? "'" + target + "': names no model; expected HOST:PORT/MODEL" : address.error().message);
    return exit_code(ErrorKind::usage);
  }
  options.address = *address;
  options.timeout_ms = static_cast<TimeMs>(timeout_s * 1000);
  options.stop = &stop_requested;
  std::signal(SIGINT, request_stop);
  std::signal(SIGTERM, request_stop);
  constexpr std::uint64_t kOwnDescriptors = 64;
  const std::uint64_t descriptors = raise_descriptor_limit();
  if (descriptors != 0 && options.clients + kOwnDescriptors > descriptors) {
    fmt::print(stderr,
               "fanstream-load: {} clients need more than this system's {} descriptors a process; raise the hard limit "
               "(ulimit -Hn) or run several processes\n",
               options.clients, descriptors);
    return exit_code(ErrorKind::limit);
  }
  const bool bar = isatty(STDERR_FILENO) != 0;
  const LoadReport report = run_load(options, [&](std::uint32_t ended, std::uint64_t bytes) {
    if (bar) tell_progress(options.clients, ended, bytes);
  });
  if (bar) fmt::print(stderr, "\r{:70}\r", "");
  json ? print_json(options, report) : print_text(report);
  return outcome(report);
}
