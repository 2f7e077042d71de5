// fanstream-bench-fetch: many clients of a running server at once, every one of which rebuilds the whole model.
// (fanstream-load goes further in numbers, but only checks the bytes.)
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "client/load/load_run.h"
#include "client/model/model_fetch.h"
#include "common/mesh/mesh_hash.h"

namespace {

using namespace fanstream;

struct Outcome {
  std::string text;  // mesh_hash or message
  bool complete = false;
  double first_mesh_s = 0;
  double complete_s = 0;
};

Outcome fetch_whole(const std::string& source) {
  const auto fetch = ModelFetch::open(source, {});
  if (!fetch) return {fetch.error().message};
  const Result<void> advanced = (*fetch)->advance({});
  if (!advanced) return {advanced.error().message};
  const FetchReport report = (*fetch)->report();
  return {mesh_hash((*fetch)->mesh().triangle_mesh()), true, report.seconds.first_mesh, report.seconds.complete};
}

nlohmann::json spread_json(const std::vector<Outcome>& outcomes, double Outcome::*value) {
  std::vector<double> values;
  for (const Outcome& outcome : outcomes) {
    if (outcome.complete) values.push_back(outcome.*value);
  }
  const Spread spread = spread_of(values);
  return {{"min", spread.min}, {"median", spread.median}, {"p95", spread.p95}, {"max", spread.max}};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Fetches and rebuilds a model in many clients at once.");
  app.footer("Example:\n  fanstream-bench-fetch localhost:7370/bunny --clients 200");
  std::string source;
  unsigned clients = 200;
  app.add_option("source", source, "HOST:PORT/MODEL, or an asset file")->required();
  app.add_option("-c,--clients", clients, "How many, a thread each")
      ->capture_default_str()
      ->check(CLI::Range(1U, 10'000U));
  CLI11_PARSE(app, argc, argv);
  const auto start = std::chrono::steady_clock::now();
  std::vector<Outcome> outcomes(clients);
  std::vector<std::thread> threads;
  for (Outcome& outcome : outcomes) threads.emplace_back([&] { outcome = fetch_whole(source); });
  for (std::thread& thread : threads) thread.join();
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::map<std::string, unsigned> hashes;
  std::map<std::string, unsigned> failures;
  for (const Outcome& outcome : outcomes) ++(outcome.complete ? hashes : failures)[outcome.text];
  const nlohmann::ordered_json json = {{"source", source},
                                       {"clients", clients},
                                       {"mesh_hashes", hashes},
                                       {"failures", failures},
                                       {"seconds", seconds},
                                       {"first_mesh_seconds", spread_json(outcomes, &Outcome::first_mesh_s)},
                                       {"complete_seconds", spread_json(outcomes, &Outcome::complete_s)}};
  fmt::print("{}\n", json.dump(2));
  return hashes.size() == 1 && failures.empty() ? 0 : 1;
}
