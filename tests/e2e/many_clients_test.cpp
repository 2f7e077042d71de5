// One server process, many clients at once, every one of them exact.
#include <gtest/gtest.h>

#include <set>
#include <thread>

#include "client/load/load_run.h"
#include "client/model/model_fetch.h"
#include "common/mesh/mesh_hash.h"
#include "tests/support/built_model.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

// What each of `clients` threads has rebuilt: a mesh_hash, or an error.
std::multiset<std::string> rebuild_at_once(const std::string& source, unsigned clients) {
  std::vector<std::string> outcomes(clients);
  std::vector<std::thread> threads;
  for (std::string& outcome : outcomes) {
    threads.emplace_back([&] {
      const auto fetch = ModelFetch::open(source, {});
      if (!fetch) return void(outcome = fetch.error().message);
      const auto advanced = (*fetch)->advance({});
      outcome = advanced ? mesh_hash((*fetch)->mesh().triangle_mesh()) : advanced.error().message;
    });
  }
  for (std::thread& thread : threads) thread.join();
  return {outcomes.begin(), outcomes.end()};
}

TEST(ManyClients, TwoHundredRebuildASphereAtOnceAndAllAreExact) {
  const TriangleMesh sphere = testing::make_sphere(30, 40);
  const auto asset = testing::build_model(sphere);
  testing::ModelServer server;
  server.add("sphere", asset);
  const auto outcomes = rebuild_at_once(server.address() + "/sphere", 200);
  EXPECT_EQ(outcomes.count(testing::quantised_hash(sphere, *asset)), 200U) << *outcomes.begin();
}

// Most take in every byte and hash it, some rebuild; tests/bench/fetch_bench_main.cpp rebuilds in all.
TEST(ManyClients, TwoHundredFetchTheBunnyAtOnceAndAllAreExact) {
  const testing::BuiltBunny* bunny = testing::built_bunny();
  if (bunny == nullptr) GTEST_SKIP() << "../shared/data has no bunny";
  testing::ModelServer server;
  server.add("bunny", bunny->asset);
  LoadOptions options;
  options.address = {"127.0.0.1", server.port(), "bunny"};
  options.clients = 192;
  LoadReport report;
  std::thread load([&] { report = run_load(options); });
  const auto outcomes = rebuild_at_once(server.address() + "/bunny", 8);
  load.join();
  EXPECT_EQ(report.complete, 192U) << (report.first_failure ? report.first_failure->message : "");
  EXPECT_EQ(report.distinct_contents, 1U);
  EXPECT_EQ(outcomes.count(testing::quantised_hash(bunny->mesh, *bunny->asset)), 8U) << *outcomes.begin();
}

}  // namespace
}  // namespace fanstream
