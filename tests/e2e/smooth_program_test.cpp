// --smooth-silhouette of fanstream-client render and session, on a quad model built by fanstream-server, as a user runs
// them.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/import/mesh_import.h"
#include "tests/support/built_model.h"
#include "tests/support/client_program.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/polygon_sources.h"

namespace fanstream {
namespace {

using testing::ProgramOutcome;
namespace fs = std::filesystem;

class SmoothProgram : public testing::ClientProgramTest {
 protected:
  void SetUp() override {
    const TriangleMesh torus = testing::make_torus(24, 14);
    input = folder.write("torus.obj", testing::obj_text(torus, testing::paired_source_faces(torus))).string();
    asset = out("torus.fan");
    const ProgramOutcome built = testing::run_program("fanstream-server", {"build", input, "-o", asset, "--json"});
    ASSERT_EQ(built.exit_code, 0) << built.error;
    build_report = nlohmann::json::parse(built.out);
  }

  std::string input, asset;
  nlohmann::json build_report;
};

TEST_F(SmoothProgram, BuildInspectAndVerifyTellOfThePolygons) {
  EXPECT_EQ(build_report["quads"], 336);
  EXPECT_EQ(build_report["larger_polygons"], 0);
  EXPECT_GT(build_report["bytes"]["polygons"], 0);
  const ProgramOutcome inspected = testing::run_program("fanstream-server", {"inspect", asset});
  EXPECT_NE(inspected.out.find("336 quads"), std::string::npos) << inspected.out;
  const ProgramOutcome verified = testing::run_program("fanstream-server", {"verify", asset, "--against", input});
  EXPECT_EQ(verified.exit_code, 0) << verified.error;
  EXPECT_NE(verified.out.find("336 polygons"), std::string::npos) << verified.out;
  // The same triangles, but none of them joined.
  const TriangleMesh cut = import_mesh(input)->mesh;
  const std::string triangles = folder.write("triangles.obj", testing::obj_text(cut, {})).string();
  const ProgramOutcome other = testing::run_program("fanstream-server", {"verify", asset, "--against", triangles});
  EXPECT_EQ(other.exit_code, exit_code(ErrorKind::bad_input));
  EXPECT_NE(other.error.find("polygons differ: 336 only in the asset"), std::string::npos) << other.error;
}

TEST_F(SmoothProgram, RenderGivesTheSameFromAFileAndFromAServer) {
  testing::ModelServer server;
  server.add("torus", AssetFile::open(asset).value());
  const std::vector<std::string> options{"--size", "320x240", "--smooth-silhouette"};
  nlohmann::json reports[2];
  const std::string sources[2] = {asset, server.address() + "/torus"};
  for (int i = 0; i < 2; ++i) {
    std::vector<std::string> arguments{"render", sources[i], "-o", out(i == 0 ? "file.png" : "server.png")};
    arguments.insert(arguments.end(), options.begin(), options.end());
    reports[i] = run_json(arguments);
    const nlohmann::json& smooth = reports[i]["smooth_silhouette"];
    EXPECT_EQ(smooth["faces_before"], 336);
    EXPECT_EQ(smooth["finest_faces"], 336);
    EXPECT_EQ(smooth["eligible_faces"], 336);
    EXPECT_GT(smooth["faces_after"], 672);
    EXPECT_GE(smooth["depth"], 4);
    EXPECT_FALSE(smooth.contains("limitation"));
    EXPECT_EQ(reports[i]["complete"], true);
  }
  EXPECT_EQ(contents(out("file.png")), contents(out("server.png")));
  const nlohmann::json plain = run_json({"render", asset, "-o", out("plain.png"), "--size", "320x240"});
  EXPECT_FALSE(plain.contains("smooth_silhouette"));
  EXPECT_NE(contents(out("plain.png")), contents(out("file.png")));
  EXPECT_LT(plain["issued_vertices"], reports[0]["issued_vertices"]);
}

TEST_F(SmoothProgram, RenderSaysWhyALevelIsNotSmoothed) {
  const ProgramOutcome outcome =
      run({"render", asset, "-o", out("level.png"), "--size", "160x120", "--vertices", "100", "--smooth-silhouette"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.error;
  EXPECT_NE(outcome.out.find("polygons have not been received"), std::string::npos) << outcome.out;
}

TEST_F(SmoothProgram, SessionAsksForThePolygonsAndSmoothsWhatIsFinest) {
  const std::vector<std::string> options{"--path", "orbit",  "--fps",          "1",   "--size", "160x120",
                                         "-o",     out("s"), "--tolerance-px", "0.01"};
  std::vector<std::string> arguments{"session", asset};
  arguments.insert(arguments.end(), options.begin(), options.end());
  arguments.emplace_back("--smooth-silhouette");
  const nlohmann::json report = run_json(arguments);
  EXPECT_GT(report["summary"]["smooth_silhouette"]["faces_after_most"], 672);
  const nlohmann::json session = nlohmann::json::parse(contents(out("s/session.json")));
  const nlohmann::json& last = session["frames"].back();
  EXPECT_EQ(last["smooth_silhouette"]["faces_before"], 336);
  EXPECT_EQ(last["smooth_silhouette"]["eligible_faces"], 336);
  EXPECT_EQ(last["state"], "complete");
  std::istringstream csv(contents(out("s/frames.csv")));
  std::string names, row;
  std::getline(csv, names);
  std::getline(csv, row);
  EXPECT_NE(names.find("smooth_faces_after"), std::string::npos);
  EXPECT_EQ(std::count(names.begin(), names.end(), ','), std::count(row.begin(), row.end(), ','));
  // Without, nothing is asked for that is not needed.
  arguments.pop_back();
  arguments[9] = out("plain");
  const nlohmann::json plain = run_json(arguments);
  EXPECT_TRUE(plain["summary"]["smooth_silhouette"].is_null());
  EXPECT_EQ(plain["summary"]["segments"].get<int>() + 1, report["summary"]["segments"].get<int>());
}

TEST_F(SmoothProgram, MistakesAreNamedWithTheirExitCodes) {
  const auto expect_usage = [&](const std::vector<std::string>& more, const std::string& text) {
    std::vector<std::string> arguments{"render", asset, "-o", out("bad.png")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramOutcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, exit_code(ErrorKind::usage));
    EXPECT_NE(outcome.error.find(text), std::string::npos) << outcome.error;
    EXPECT_FALSE(fs::exists(out("bad.png")));
  };
  expect_usage({"--crease-angle", "30"}, "--smooth-silhouette");
  expect_usage({"--smooth-silhouette", "--crease-angle", "0"}, "--crease-angle");
  expect_usage({"--smooth-silhouette", "--crease-angle", "sharp"}, "--crease-angle");
}

}  // namespace
}  // namespace fanstream
