// fanstream-client as a user runs it: outputs, messages, exit codes.
#include "tests/support/client_program.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "common/import/mesh_import.h"
#include "common/mesh/mesh_hash.h"
#include "tests/support/built_model.h"
#include "tests/support/cutting_relay.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

using testing::ProgramOutcome;

class ClientProgram : public testing::ClientProgramTest {
 protected:
  std::string source() const { return server.address() + "/torus"; }

  void SetUp() override { server.add("torus", asset()); }

  static const TriangleMesh& mesh() {
    static const TriangleMesh torus = testing::make_torus(60, 40);
    return torus;
  }
  static std::shared_ptr<const AssetFile> asset() {
    static const auto built = testing::build_model(mesh());
    return built;
  }

  testing::ModelServer server;
};

TEST_F(ClientProgram, HelpFitsEightyColumnsAndHasAnExample) {
  for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
           {"--help"}, {"list", "--help"}, {"fetch", "--help"}, {"render", "--help"}, {"snapshots", "--help"}}) {
    expect_help(run(arguments));
  }
}

TEST_F(ClientProgram, ListShowsEveryStateOfAModel) {
  ModelStatus building;
  building.state = ModelStatus::State::building;
  building.fraction = 0.5;
  server.models->set("slow", building);
  ModelStatus failed;
  failed.state = ModelStatus::State::failed;
  failed.reason = "no triangles";
  server.models->set("wrong", failed);
  const ProgramOutcome text = run({"list", server.address()});
  EXPECT_EQ(text.exit_code, 0);
  for (const char* part : {"torus", "2,400", "4,800", "building, 50 %", "failed: no triangles"}) {
    EXPECT_NE(text.out.find(part), std::string::npos) << part << "\n" << text.out;
  }
  const nlohmann::json json = run_json({"list", server.address()});
  ASSERT_EQ(json["models"].size(), 3U);
  EXPECT_EQ(json["models"][0]["name"], "slow");
  EXPECT_EQ(json["models"][0]["state"], "building");
  EXPECT_EQ(json["models"][1]["digest"], text_of(asset()->digest()));
  EXPECT_EQ(json["models"][2]["reason"], "no triangles");
}

TEST_F(ClientProgram, FetchWritesTheExactMeshAndReportsIt) {
  const nlohmann::json json = run_json({"fetch", source(), "-o", out("torus.ply")});
  const std::string expected = testing::quantised_hash(mesh(), *asset());
  EXPECT_EQ(json["mesh_hash"], expected);
  EXPECT_EQ(json["model"], "torus");
  EXPECT_EQ(json["digest"], text_of(asset()->digest()));
  EXPECT_EQ(json["vertices"], mesh().positions.size());
  EXPECT_EQ(json["triangles"], mesh().triangles.size());
  EXPECT_EQ(json["complete"], true);
  for (const char* part : {"received", "head", "index", "segments"}) EXPECT_TRUE(json["bytes"].contains(part));
  for (const char* part : {"connect", "head", "first_mesh", "complete"}) EXPECT_TRUE(json["seconds"].contains(part));
  const auto written = import_mesh(out("torus.ply"));
  ASSERT_TRUE(written) << written.error().message;
  EXPECT_EQ(mesh_hash(written->mesh), expected);
}

TEST_F(ClientProgram, FetchedLevelsSayWhatWasReached) {
  const ProgramOutcome text = run({"fetch", source(), "-o", out("torus.obj"), "--vertices", "700"});
  EXPECT_EQ(text.exit_code, 0) << text.error;
  EXPECT_NE(text.out.find("asked for 700 vertices"), std::string::npos) << text.out;
  const nlohmann::json json = run_json({"fetch", source(), "-o", out("torus.glb"), "--bytes", "4000"});
  EXPECT_EQ(json["level"]["asked"], 4000);
  EXPECT_EQ(json["level"]["is"], "below");
  EXPECT_LE(json["bytes"]["received"], 4000);
  EXPECT_EQ(json["complete"], false);
  EXPECT_TRUE(import_mesh(out("torus.glb")));
}

TEST_F(ClientProgram, FansAndTrianglesGiveTheSamePicture) {
  const auto contents = [&](const std::string& name) {
    std::ifstream file(out(name), std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  for (const std::vector<std::string>& level : std::vector<std::vector<std::string>>{{}, {"--vertices", "500"}}) {
    std::vector<std::string> arguments{"render", source(), "-o", out("fans.png"), "--size", "320x240"};
    arguments.insert(arguments.end(), level.begin(), level.end());
    const nlohmann::json fans = run_json(arguments);
    arguments[3] = out("triangles.png");
    arguments.insert(arguments.end(), {"--draw", "triangles"});
    const nlohmann::json triangles = run_json(arguments);
    EXPECT_EQ(contents("fans.png"), contents("triangles.png"));
    EXPECT_GT(contents("fans.png").size(), 2000U) << "not just background";
    EXPECT_EQ(triangles["issued_vertices"], 3 * triangles["triangles"].get<int>());
    EXPECT_LT(fans["issued_vertices"], triangles["issued_vertices"]);
  }
}

TEST_F(ClientProgram, SnapshotsGoFromTheBaseToTheWholeModel) {
  const nlohmann::json json = run_json({"snapshots", source(), "-o", out("levels.png"), "--size", "160x120"});
  const auto& levels = json["levels"];
  ASSERT_GE(levels.size(), 4U);
  EXPECT_EQ(levels.front()["vertices"], asset()->asset_head()->base.places.size());
  EXPECT_EQ(levels.front()["bytes"], asset()->head().size());
  EXPECT_EQ(levels.back()["vertices"], mesh().positions.size());
  EXPECT_EQ(levels.back()["bytes"], asset()->preamble().section_bytes());
  for (std::size_t i = 1; i < levels.size(); ++i) {
    EXPECT_GT(levels[i]["vertices"], levels[i - 1]["vertices"]);
    EXPECT_GE(levels[i]["bytes"], levels[i - 1]["bytes"]);  // two levels may lie within one layer
  }
  EXPECT_GT(std::filesystem::file_size(out("levels.png")), 5000U);
}

TEST_F(ClientProgram, MistakesAreNamedWithTheirExitCodes) {
  const std::string empty = folder.write("empty.fan", "").string();
  std::uint16_t unused = 0;
  {
    const RawListener listener;
    unused = listener.port();
  }
  const std::string nobody = "127.0.0.1:" + std::to_string(unused);
  const std::string ply = out("x.ply"), png = out("x.png");
  expect_failure(run({}), ErrorKind::usage, "subcommand");
  expect_failure(run({"fetch", source()}), ErrorKind::usage, "--output");
  expect_failure(run({"fetch", source(), "-o", ply, "--vertices", "5", "--bytes", "5"}), ErrorKind::usage, "excludes");
  expect_failure(run({"fetch", source(), "-o", ply, "--vertices", "-5"}), ErrorKind::usage, "--vertices");
  expect_failure(run({"fetch", "no/such.fan", "-o", ply}), ErrorKind::not_found, "no/such.fan");
  expect_failure(run({"fetch", empty, "-o", ply}), ErrorKind::bad_input, "empty.fan");
  expect_failure(run({"fetch", server.address() + "/none", "-o", ply}), ErrorKind::not_found, "fanstream-client list");
  expect_failure(run({"fetch", nobody + "/bunny", "-o", ply}), ErrorKind::network, nobody);
  expect_failure(run({"list", nobody}), ErrorKind::network, nobody);
  expect_failure(run({"list", source()}), ErrorKind::usage, "HOST:PORT");
  expect_failure(run({"fetch", source(), "-o", out("x.stl")}), ErrorKind::usage, "x.stl");
  expect_failure(run({"fetch", source(), "-o", out("none/x.ply")}), ErrorKind::not_found, "none");
  expect_failure(run({"fetch", source(), "-o", "/proc/x.ply"}), ErrorKind::io, "/proc/x.ply");
  expect_failure(run({"render", source(), "-o", out("x.jpg")}), ErrorKind::usage, ".png");
  expect_failure(run({"render", source(), "-o", png, "--size", "0x5"}), ErrorKind::usage, "--size");
  expect_failure(run({"render", source(), "-o", png, "--size", "99999x99999"}), ErrorKind::usage, "--size");
  expect_failure(run({"render", source(), "-o", png, "--eye", "1,2"}), ErrorKind::usage, "--eye");
  expect_failure(run({"render", source(), "-o", png, "--target", "1,2,3"}), ErrorKind::usage, "--eye");
  expect_failure(run({"render", source(), "-o", png, "--eye", "1,2,3", "--target", "1,2,3"}), ErrorKind::usage, "eye");
  expect_failure(run({"render", source(), "-o", png, "--draw", "strips"}), ErrorKind::usage, "strips");
  EXPECT_FALSE(std::filesystem::exists(ply));
  EXPECT_FALSE(std::filesystem::exists(png));
}

TEST_F(ClientProgram, AServerGoneMidStreamLeavesAFileOnlyIfAsked) {
  for (const bool keep : {false, true}) {
    const testing::CuttingRelay relay(server.port(), asset()->size_bytes() / 2);
    const std::string host = "127.0.0.1:" + std::to_string(relay.port());
    std::vector<std::string> arguments{"fetch", host + "/torus", "-o", out("torus.ply")};
    if (keep) arguments.emplace_back("--keep-partial");
    const ProgramOutcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, exit_code(ErrorKind::network));
    EXPECT_NE(outcome.error.find(host), std::string::npos) << outcome.error;
    EXPECT_NE(outcome.error.find(std::to_string(asset()->size_bytes() / 2) + " bytes"), std::string::npos)
        << outcome.error;
    EXPECT_EQ(std::filesystem::exists(out("torus.ply")), keep);
  }
  EXPECT_TRUE(import_mesh(out("torus.ply")));
}

TEST_F(ClientProgram, AnInterruptEndsAWaitCleanly) {
  ModelStatus building;
  building.state = ModelStatus::State::building;
  server.models->set("slow", building);
  testing::Program program("fanstream-client", {"fetch", server.address() + "/slow", "-o", out("slow.ply")});
  for (int i = 0; i < 2000 && server.server->metrics().sessions_open == 0; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  program.signal(SIGINT);
  const ProgramOutcome outcome = program.wait();
  EXPECT_EQ(outcome.exit_code, 130);
  EXPECT_NE(outcome.error.find("stopped by the user"), std::string::npos) << outcome.error;
  EXPECT_FALSE(std::filesystem::exists(out("slow.ply")));
}

}  // namespace
}  // namespace fanstream
