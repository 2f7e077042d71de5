// `fanstream-server serve` over loopback: the real program, and clients of ours.
#include <gtest/gtest.h>
#include <signal.h>

#include <nlohmann/json.hpp>

#include "client/model/segment_order.h"
#include "client/net/stream_client.h"
#include "common/asset/asset_file.h"
#include "common/import/mesh_cleaner.h"
#include "common/refine/progressive_mesh.h"
#include "server/verify/source_comparison.h"
#include "tests/support/mesh_files.h"
#include "tests/support/program.h"
#include "tests/support/small_assets.h"

namespace fanstream {
namespace {

using testing::Program;
using testing::ProgramOutcome;
using Json = nlohmann::json;

class ServeTest : public ::testing::Test {
 protected:
  void start(const std::vector<std::string>& more = {}) {
    std::filesystem::create_directories(folder.path() / "models");
    std::vector<std::string> arguments{"serve",   folder.path() / "models", "--host", "127.0.0.1", "--port", "0",
                                       "--store", folder.path() / "store",  "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    server.emplace("fanstream-server", arguments);
    ASSERT_TRUE(server->wait_for_output("\"listening\"")) << server->error();
    const std::string out = server->out();
    const Json first = Json::parse(out.substr(0, out.find('\n')));
    EXPECT_EQ(first["host"], "127.0.0.1");
    port = first["port"];
  }
  Result<StreamClient> connect() const { return StreamClient::connect({"127.0.0.1", port, ""}); }
  void write_model(const std::string& name, const TriangleMesh& mesh) const {
    folder.write("models/" + name, testing::ply_binary(mesh, false));
  }
  // Streams a model wholly, rebuilds it and compares it with its source.
  void expect_exact(const std::string& name, const TriangleMesh& source);
  void expect_clean_stop(int signal_number) {
    server->signal(signal_number);
    const ProgramOutcome outcome = server->wait();
    EXPECT_EQ(outcome.exit_code, 0) << outcome.error;
    EXPECT_NE(outcome.out.find("\"stopped\""), std::string::npos) << outcome.out;
  }

  testing::TemporaryFolder folder;
  std::optional<Program> server;
  std::uint16_t port = 0;
};

void ServeTest::expect_exact(const std::string& name, const TriangleMesh& source) {
  SCOPED_TRACE(name);
  Result<StreamClient> client = connect();
  ASSERT_TRUE(client.has_value()) << client.error().message;
  const Result<Opened> opened = client->open(name);
  ASSERT_TRUE(opened.has_value()) << opened.error().message;
  const Result<Bytes> head_bytes = client->receive_head();
  ASSERT_TRUE(head_bytes.has_value()) << head_bytes.error().message;
  Result<AssetHead> head = read_head(*head_bytes, name);
  ASSERT_TRUE(head.has_value()) << head.error().message;
  const Result<AssetPreamble> preamble = read_preamble(*head_bytes, name);
  ASSERT_TRUE(preamble.has_value());
  EXPECT_EQ(preamble->digest, opened->digest);
  const Result<Bytes> index_bytes = client->receive_index();
  ASSERT_TRUE(index_bytes.has_value()) << index_bytes.error().message;
  Result<AssetIndex> index = read_index(*index_bytes, *preamble, *head, name);
  ASSERT_TRUE(index.has_value()) << index.error().message;
  ASSERT_TRUE(client->set_segment_table(segment_table(*index)).has_value());
  ProgressiveMesh mesh(std::make_shared<AssetHead>(std::move(*head)));
  mesh.set_index(std::make_shared<AssetIndex>(std::move(*index)));
  ASSERT_TRUE(client->set_wants({{0, opened->cell_count, kAllSegments}}));
  while (!mesh.is_complete()) {
    const auto next = client->next_event(10'000);
    ASSERT_TRUE(next.has_value()) << next.error().message;
    ASSERT_TRUE(next->has_value()) << "nothing came for 10 s";
    const auto* arrived = std::get_if<event::SegmentArrived>(&**next);
    if (arrived == nullptr) break;
    ASSERT_TRUE(mesh.add_segment(arrived->cell, arrived->segment, arrived->bytes).has_value());
    ASSERT_TRUE(mesh.refine().has_value());
  }
  const Result<std::string> same =
      compare_with_source(mesh.triangle_mesh(), mesh.head().grid, source, "streamed", name);
  EXPECT_TRUE(same.has_value()) << same.error().message;
}

TEST_F(ServeTest, TwoGoodModelsStreamExactlyBesideABadOne) {
  const TriangleMesh torus = testing::make_torus(60, 40);
  const TriangleMesh terrain = testing::make_terrain(50, 40, 3);
  write_model("torus.ply", torus);
  write_model("terrain.ply", terrain);
  folder.write("models/bad.ply", "ply\nformat ascii 1.0\nnonsense\n");
  start();
  expect_exact("torus", torus);
  expect_exact("terrain", terrain);
  Result<StreamClient> client = connect();
  ASSERT_TRUE(client.has_value());
  const Result<Opened> bad = client->open("bad");
  ASSERT_FALSE(bad.has_value());
  EXPECT_NE(bad.error().message.find("bad.ply"), std::string::npos) << bad.error().message;
  EXPECT_EQ(bad.error().message.find(folder.path().string()), std::string::npos) << bad.error().message;
  const auto entries = connect()->list();
  ASSERT_TRUE(entries.has_value());
  ASSERT_EQ(entries->size(), 3U);
  EXPECT_EQ((*entries)[0].name, "bad");
  EXPECT_EQ((*entries)[0].state, ModelState::failed);
  EXPECT_EQ((*entries)[2].state, ModelState::ready);
  expect_clean_stop(SIGTERM);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path() / "store"), {}), 2);

  // Started again, it builds nothing.
  start();
  expect_exact("torus", torus);
  expect_clean_stop(SIGINT);
  EXPECT_EQ(server->out().find("\"building\",\"model\":\"torus\""), std::string::npos) << server->out();
}

TEST_F(ServeTest, StopsWhileBuildingWithoutAHalfWrittenFile) {
  for (int i = 0; i < 4; ++i) write_model("torus" + std::to_string(i) + ".ply", testing::make_torus(400, 200));
  start();
  ASSERT_TRUE(server->wait_for_output("\"building\""));
  expect_clean_stop(SIGTERM);
  for (const auto& entry : std::filesystem::directory_iterator(folder.path() / "store")) {
    EXPECT_TRUE(AssetFile::open(entry.path()).has_value()) << entry.path();
  }
}

TEST_F(ServeTest, PortInUseMissingFolderAndUnwritableStoreAreClearErrors) {
  write_model("torus.ply", testing::make_torus(20, 12));
  start();
  const std::string models = folder.path() / "models";
  const ProgramOutcome in_use = testing::run_program(
      "fanstream-server",
      {"serve", models, "--host", "127.0.0.1", "--port", std::to_string(port), "--store", folder.path() / "other"});
  EXPECT_EQ(in_use.exit_code, 8);
  EXPECT_NE(in_use.error.find("port " + std::to_string(port) + " is in use"), std::string::npos) << in_use.error;
  const ProgramOutcome missing = testing::run_program("fanstream-server", {"serve", folder.path() / "none"});
  EXPECT_EQ(missing.exit_code, 3);
  EXPECT_NE(missing.error.find("no such folder"), std::string::npos) << missing.error;
  const ProgramOutcome unwritable =
      testing::run_program("fanstream-server", {"serve", models, "--port", "0", "--store", "/proc/fanstream-store"});
  EXPECT_EQ(unwritable.exit_code, 4);
  EXPECT_NE(unwritable.error.find("choose another folder with --store"), std::string::npos) << unwritable.error;
}

}  // namespace
}  // namespace fanstream
