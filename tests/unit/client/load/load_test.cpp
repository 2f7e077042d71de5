// The load generator: its figures, and the program's exit codes and JSON.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "client/load/load_run.h"
#include "server/net/stream_server.h"
#include "tests/support/asset_helpers.h"
#include "tests/support/built_model.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/synthetic_source.h"

namespace fanstream {
namespace {

struct ProgramRun {
  int exit_code = -1;
  std::string output;
};

ProgramRun run_program(const std::string& arguments) {
  ProgramRun run;
  FILE* const pipe = ::popen((std::string(FANSTREAM_BIN_DIR) + "/fanstream-load " + arguments + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return run;
  std::array<char, 4096> part;
  for (std::size_t size = 0; (size = std::fread(part.data(), 1, part.size(), pipe)) > 0;)
    run.output.append(part.data(), size);
  const int status = ::pclose(pipe);
  if (WIFEXITED(status)) run.exit_code = WEXITSTATUS(status);
  return run;
}

class LoadTest : public ::testing::Test {
 protected:
  void SetUp() override {
    models.add("model", asset);
    place = models.address();
  }
  std::shared_ptr<const AssetFile> asset = testing::build_model(testing::make_sphere(20, 30));
  testing::ModelServer models;
  std::string place;
};

TEST_F(LoadTest, ReadsPagesAsTheyCome) {
  const auto paged = testing::build_model(testing::make_sphere(30, 40), testing::small_cells());
  ASSERT_TRUE(paged->asset_head()->has_pages);
  models.add("paged", paged);
  const ProgramRun run = run_program(place + "/paged --clients 5 --json");
  ASSERT_EQ(run.exit_code, 0) << run.output;
  const nlohmann::json report = nlohmann::json::parse(run.output, nullptr, false);
  ASSERT_FALSE(report.is_discarded()) << run.output;
  EXPECT_EQ(report["complete"], 5);
  EXPECT_EQ(report["segments"], 5 * segment_table(*paged)->nonempty_total());
}

TEST_F(LoadTest, JsonCountsEveryClientAndSegment) {
  const ProgramRun run = run_program(place + "/model --clients 20 --json");
  ASSERT_EQ(run.exit_code, 0) << run.output;
  const nlohmann::json report = nlohmann::json::parse(run.output, nullptr, false);
  ASSERT_FALSE(report.is_discarded()) << run.output;
  EXPECT_EQ(report["complete"], 20);
  EXPECT_EQ(report["distinct_contents"], 1);
  EXPECT_EQ(report["segments"], 20 * segment_table(*asset)->nonempty_total());
  EXPECT_TRUE(report["failures"].empty());
  for (const char* latency : {"connected_ms", "head_ms", "complete_ms"}) {
    EXPECT_LE(report[latency]["min"], report[latency]["median"]);
    EXPECT_LE(report[latency]["median"], report[latency]["p95"]);
    EXPECT_LE(report[latency]["p95"], report[latency]["max"]);
  }
}

TEST_F(LoadTest, ExitCodesSayWhatWentWrong) {
  EXPECT_EQ(run_program("--help").exit_code, 0);
  EXPECT_NE(run_program("--help").output.find("Example"), std::string::npos);
  EXPECT_EQ(run_program("").exit_code, 2);
  EXPECT_EQ(run_program(place).exit_code, 2);  // no model
  EXPECT_EQ(run_program(place + "/model --clients 0").exit_code, 2);
  const ProgramRun missing = run_program(place + "/missing --clients 3");
  EXPECT_EQ(missing.exit_code, 3);
  EXPECT_NE(missing.output.find("missing"), std::string::npos);
  models.server->stop();
  const ProgramRun refused = run_program(place + "/model --clients 3");
  EXPECT_EQ(refused.exit_code, 8);
  EXPECT_NE(refused.output.find(place), std::string::npos);
}

TEST_F(LoadTest, MoreClientsThanMayConnectAtOnceAllComplete) {
  LoadOptions options;
  options.address = {"127.0.0.1", models.port(), "model"};
  options.clients = 60;
  options.connecting = 3;
  options.threads = 2;
  const LoadReport report = run_load(options);
  EXPECT_EQ(report.complete, 60U);
  EXPECT_EQ(report.distinct_contents, 1U);
}

// Gives every client another last byte, as a broken server would.
class ForgetfulProvider final : public ModelProvider {
 public:
  std::vector<CatalogueEntry> catalogue() override { return {}; }
  ModelStatus open(const std::string&) override {
    return {ModelStatus::State::ready, 1, "", std::make_shared<SyntheticSource>(SyntheticShape{++seed})};
  }
  std::atomic<std::uint32_t> seed{0};
};

TEST(Load, ClientsThatReceiveDifferentBytesAreNoticed) {
  ServerOptions server_options;
  server_options.host = "127.0.0.1";
  server_options.port = 0;
  auto server = StreamServer::start(server_options, std::make_shared<ForgetfulProvider>());
  ASSERT_TRUE(server);
  LoadOptions options;
  options.address = {"127.0.0.1", (*server)->port(), "model"};
  options.clients = 5;
  options.read_table = [](Bytes head, Bytes) -> Result<std::shared_ptr<const SegmentTable>> {
    for (std::uint32_t seed = 1; seed < 100; ++seed) {
      const SyntheticSource source(SyntheticShape{seed});
      if (std::ranges::equal(head, source.head())) return source.table();
    }
    return fail(ErrorKind::bad_input, "the head of no model");
  };
  EXPECT_EQ(run_load(options).distinct_contents, 5U);
}

TEST(Load, SpreadTakesTheNearestRank) {
  std::vector<double> values;
  for (int i = 100; i >= 1; --i) values.push_back(i);
  const Spread spread = spread_of(values);
  EXPECT_EQ(spread.min, 1);
  EXPECT_EQ(spread.median, 50);
  EXPECT_EQ(spread.p95, 95);
  EXPECT_EQ(spread.max, 100);
  EXPECT_EQ(spread_of({}).max, 0);
  EXPECT_EQ(spread_of({7}).p95, 7);
}

}  // namespace
}  // namespace fanstream
