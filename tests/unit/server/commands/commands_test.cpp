// fanstream-server as a user meets it: the real program, its messages and exit codes.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <nlohmann/json.hpp>

#include "tests/support/mesh_files.h"
#include "tests/support/program.h"
#include "tests/support/small_assets.h"

namespace fanstream {
namespace {

using testing::ProgramOutcome;
using Json = nlohmann::json;

class ServerCommandsTest : public ::testing::Test {
 protected:
  static ProgramOutcome run(const std::vector<std::string>& arguments) {
    return testing::run_program("fanstream-server", arguments);
  }
  // The program ends with this code and one line on standard error that holds all the texts.
  static void expect_error(const std::vector<std::string>& arguments, int code, const std::vector<std::string>& texts) {
    const ProgramOutcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, code) << outcome.error;
    for (const std::string& text : texts)
      EXPECT_NE(outcome.error.find(text), std::string::npos) << text << "\n" << outcome.error;
    EXPECT_TRUE(outcome.error.starts_with("fanstream-server: ")) << outcome.error;
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
  }
  std::string path(const std::string& name) const { return folder.path() / name; }
  std::string torus() const {
    return folder.write("torus.ply", testing::ply_binary(testing::make_torus(40, 24), false));
  }
  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder.path()), {}));
  }

  testing::TemporaryFolder folder;
};

TEST_F(ServerCommandsTest, HelpHasAnExampleAndEndsWithZero) {
  EXPECT_NE(run({"--help"}).out.find("fanstream-server build bunny.ply"), std::string::npos);
  for (const std::string command : {"build", "inspect", "verify", "serve"}) {
    const ProgramOutcome outcome = run({command, "--help"});
    EXPECT_EQ(outcome.exit_code, 0);
    EXPECT_NE(outcome.out.find("fanstream-server " + command + " "), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("--json"), std::string::npos) << outcome.out;
  }
}

TEST_F(ServerCommandsTest, WrongUsageEndsWithTwo) {
  EXPECT_EQ(run({}).exit_code, 2);
  EXPECT_EQ(run({"frobnicate"}).exit_code, 2);
  EXPECT_EQ(run({"build", torus()}).exit_code, 2);
  EXPECT_EQ(run({"build", torus(), "-o", path("x.fan"), "--position-bits", "99"}).exit_code, 2);
  EXPECT_EQ(run({"serve", path("."), "--port", "70000"}).exit_code, 2);
}

TEST_F(ServerCommandsTest, BuildInspectAndVerifyAgree) {
  const ProgramOutcome built = run({"build", torus(), "-o", path("torus.fan"), "--position-bits", "11", "--json"});
  ASSERT_EQ(built.exit_code, 0) << built.error;
  const Json report = Json::parse(built.out);
  EXPECT_EQ(report["vertices"], 960);
  EXPECT_EQ(report["triangles"], 1920);
  EXPECT_EQ(report["components"], 1);
  EXPECT_EQ(report["position_bits"], 11);
  EXPECT_EQ(report["splits"].get<int>() + report["base_vertices"].get<int>(), 960);
  const Json bytes = report["bytes"];
  EXPECT_EQ(bytes["total"].get<int>(),
            bytes["base"].get<int>() + bytes["splits"].get<int>() + bytes["tables"].get<int>());
  EXPECT_EQ(bytes["total"].get<std::uintmax_t>(), std::filesystem::file_size(path("torus.fan")));
  EXPECT_DOUBLE_EQ(report["bits_per_vertex"].get<double>(), 8.0 * bytes["total"].get<double>() / 960);
  EXPECT_GT(report["build_seconds"].get<double>(), 0.0);
  EXPECT_GT(report["peak_memory_bytes"].get<std::uint64_t>(), 1'000'000U);
  EXPECT_EQ(report["repairs"]["welded_vertices"], 0);
  for (const char* name : {"generations", "base_triangles", "cells", "output", "digest"})
    EXPECT_TRUE(report.contains(name)) << name;

  const ProgramOutcome inspected = run({"inspect", path("torus.fan"), "--json"});
  ASSERT_EQ(inspected.exit_code, 0) << inspected.error;
  const Json held = Json::parse(inspected.out);
  for (const char* name : {"digest", "vertices", "triangles", "components", "position_bits", "generations",
                           "base_vertices", "base_triangles", "splits", "cells", "segments", "bits_per_vertex"}) {
    EXPECT_EQ(held[name], report[name]) << name;
  }
  for (const char* name : {"total", "base", "splits", "tables"}) EXPECT_EQ(held["bytes"][name], bytes[name]) << name;

  const ProgramOutcome verified = run({"verify", path("torus.fan"), "--against", torus(), "--json"});
  EXPECT_EQ(verified.exit_code, 0) << verified.error;
  EXPECT_EQ(Json::parse(verified.out)["valid"], true);
  EXPECT_EQ(Json::parse(verified.out)["digest"], report["digest"]);
}

TEST_F(ServerCommandsTest, SummariesFitEightyColumns) {
  const ProgramOutcome built = run({"build", torus(), "-o", path("torus.fan")});
  std::istringstream lines(built.out + run({"inspect", path("torus.fan")}).out);
  std::string line;
  while (std::getline(lines, line)) {
    if (line.find(folder.path()) != std::string::npos) continue;
    EXPECT_LE(line.size(), 80U) << line;
  }
}

TEST_F(ServerCommandsTest, SeveralInputsGoIntoAFolderAndOneBadOneDoesNotStopTheOthers) {
  folder.write("bad.obj", "v 1 2 nonsense\n");
  folder.write("quad.off", testing::off_text(testing::make_grid(1, 1)));
  const ProgramOutcome built =
      run({"build", torus(), path("bad.obj"), path("quad.off"), "-o", path("assets"), "--json"});
  EXPECT_EQ(built.exit_code, 5);
  EXPECT_NE(built.error.find("bad.obj: line 1"), std::string::npos) << built.error;
  const Json reports = Json::parse(built.out);
  ASSERT_EQ(reports.size(), 2U);
  EXPECT_EQ(reports[1]["output"], path("assets/quad.fan"));
  EXPECT_TRUE(std::filesystem::exists(path("assets/torus.fan")));
  EXPECT_TRUE(std::filesystem::exists(path("assets/quad.fan")));
  EXPECT_FALSE(std::filesystem::exists(path("assets/bad.fan")));
  expect_error({"build", torus(), path("torus.off"), "-o", path("assets")}, 2, {"torus.off", "another input"});
  expect_error({"build", torus(), path("quad.off"), "-o", path("bad.obj")}, 2, {"bad.obj", "-o DIR"});
}

TEST_F(ServerCommandsTest, BadInputsOfBuild) {
  const std::string out = path("x.fan");
  expect_error({"build", path("none.ply"), "-o", out}, 3, {"none.ply"});
  expect_error({"build", folder.write("empty.ply", ""), "-o", out}, 5, {"empty.ply", "empty"});
  expect_error({"build", folder.write("text.stl", "hello"), "-o", out}, 5, {"text.stl"});
  const std::string whole = testing::ply_binary(testing::make_torus(20, 12), false);
  expect_error({"build", folder.write("cut.ply", whole.substr(0, whole.size() / 2)), "-o", out}, 5,
               {"cut.ply", "byte"});
  expect_error({"build", folder.write("none.off", "OFF\n0 0 0\n"), "-o", out}, 5, {"none.off"});
  expect_error({"build", folder.write("flat.off", "OFF\n3 1 0\n0 0 0\n0 0 0\n0 0 0\n3 0 1 2\n"), "-o", out}, 5,
               {"flat.off", "no triangle is left"});
  expect_error({"build", folder.write("range.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n"), "-o", out}, 5,
               {"range.off", "7"});
  expect_error({"build", folder.write("nan.off", "OFF\n3 1 0\n0 nan 0\n1 0 0\n0 1 0\n3 0 1 2\n"), "-o", out}, 5,
               {"nan.off"});
  expect_error({"build", folder.write("huge.off", "OFF\n3 1 0\n0 1e300 0\n1 0 0\n0 1 0\n3 0 1 2\n"), "-o", out}, 5,
               {"huge.off"});
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST_F(ServerCommandsTest, BuildThatCannotBeWrittenLeavesEverythingAsItWas) {
  const std::string input = torus();
  expect_error({"build", input, "-o", "/dev/full"}, 4, {"/dev/full", "No space left"});
  expect_error({"build", input, "-o", path("no/such/folder.fan")}, 4, {"folder.fan", "create the directory first"});
  expect_error({"build", input, "-o", input}, 2, {"torus.ply", "the model would be lost"});
  EXPECT_EQ(files(), 1U);
}

TEST_F(ServerCommandsTest, TwoTriangleMeshIsBuiltAndVerified) {
  const std::string input = folder.write("quad.off", testing::off_text(testing::make_grid(1, 1)));
  EXPECT_EQ(run({"build", input, "-o", path("quad.fan")}).exit_code, 0);
  const ProgramOutcome verified = run({"verify", path("quad.fan"), "--against", input});
  EXPECT_EQ(verified.exit_code, 0) << verified.error;
}

TEST_F(ServerCommandsTest, BadAssets) {
  const std::string asset = testing::as_text(testing::small_asset());
  for (const std::string command : {"inspect", "verify"}) {
    SCOPED_TRACE(command);
    expect_error({command, path("none.fan")}, 3, {"none.fan", "no such file"});
    expect_error({command, folder.path()}, 4, {"is a directory"});
    expect_error({command, folder.write("empty.fan", "")}, 5, {"empty.fan", "is empty"});
    expect_error({command, folder.write("text.fan", "hello")}, 5, {"text.fan", "not a Fanstream asset"});
    expect_error({command, folder.write("cut.fan", asset.substr(0, 300))}, 5, {"cut.fan", "cut short at byte 300"});
    std::string other_version = asset;
    other_version[4] = 9;
    expect_error({command, folder.write("version.fan", other_version)}, 6, {"version.fan", "version 9"});
    std::string flipped = asset;
    flipped[flipped.size() - 1] = static_cast<char>(flipped.back() ^ 4);
    expect_error({command, folder.write("flipped.fan", flipped)}, 5, {"flipped.fan", "damaged in bytes 48 to "});
  }
}

TEST_F(ServerCommandsTest, VerifyAgainstAnotherModelNamesTheDifference) {
  TriangleMesh mesh = testing::make_torus(40, 24);
  ASSERT_EQ(run({"build", torus(), "-o", path("torus.fan")}).exit_code, 0);
  std::swap(mesh.triangles[5][1], mesh.triangles[5][2]);
  mesh.triangles.pop_back();
  const std::string other = folder.write("other.ply", testing::ply_binary(mesh, false));
  const ProgramOutcome verified = run({"verify", path("torus.fan"), "--against", other});
  EXPECT_EQ(verified.exit_code, 5);
  EXPECT_NE(verified.error.find("faces differ: 1 only in the asset: ("), std::string::npos) << verified.error;
  EXPECT_NE(verified.out.find("refinement  ok"), std::string::npos) << verified.out;
}

}  // namespace
}  // namespace fanstream
