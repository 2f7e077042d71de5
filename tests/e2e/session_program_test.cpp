// fanstream-client session as a user runs it: files, figures, exit codes.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/support/client_program.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/small_assets.h"

namespace fanstream {
namespace {

using testing::ProgramOutcome;
namespace fs = std::filesystem;

class SessionProgram : public testing::ClientProgramTest {
 protected:
  SessionProgram() : ClientProgramTest("session") {}
  void SetUp() override {
    static const std::string bytes = testing::as_text(testing::small_asset(testing::make_torus(60, 40)));
    asset = folder.write("torus.fan", bytes).string();
  }
  static std::set<std::string> names_in(const fs::path& path) {
    std::set<std::string> names;
    for (const auto& file : fs::directory_iterator(path)) names.insert(file.path().filename().string());
    return names;
  }
  static void expect_png(const fs::path& path) { EXPECT_EQ(contents(path).substr(0, 4), "\x89PNG") << path; }
  void expect_failure(const std::vector<std::string>& arguments, ErrorKind kind, const std::string& text) const {
    SCOPED_TRACE(text);
    ClientProgramTest::expect_failure(run(arguments), kind, text);
    EXPECT_FALSE(fs::exists(out("bad")));
  }

  std::string asset;
};

TEST_F(SessionProgram, WritesTablesAndPlotsThatAreTheSameEveryTime) {
  const std::vector<std::string> options{"--path", "orbit", "--fps", "2", "--size", "64x48", "--no-pictures"};
  for (const char* name : {"a", "b"}) {
    std::vector<std::string> arguments{asset, "-o", out(name)};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const ProgramOutcome outcome = run(arguments);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.error;
    EXPECT_NE(outcome.out.find("torus"), std::string::npos) << outcome.out;
    EXPECT_EQ(names_in(out(name)),
              (std::set<std::string>{"frames.csv", "session.json", "error_by_bytes.png", "error_by_time.png"}));
    expect_png(out(name) + "/error_by_bytes.png");
    expect_png(out(name) + "/error_by_time.png");
  }
  const auto session = nlohmann::json::parse(contents(out("a") + "/session.json"));
  const auto again = nlohmann::json::parse(contents(out("b") + "/session.json"));
  ASSERT_EQ(session["frames"].size(), 25U) << "12 s, both ends included";
  for (std::size_t i = 0; i < session["frames"].size(); ++i) {
    auto a = session["frames"][i];
    auto b = again["frames"][i];
    for (const char* clock : {"plan_ms", "apply_ms", "draw_ms"}) a.erase(clock), b.erase(clock);
    EXPECT_EQ(a, b) << "frame " << i;
  }
  EXPECT_EQ(session["frames"].back()["state"], "complete");
  const std::string table = contents(out("a") + "/frames.csv");
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 26);
}

TEST_F(SessionProgram, DrawsEveryFrame) {
  const ProgramOutcome outcome =
      run({asset, "-o", out("p"), "--path", "jump", "--fps", "2", "--size", "64x48", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.error;
  const auto json = nlohmann::json::parse(outcome.out, nullptr, false);
  ASSERT_FALSE(json.is_discarded()) << outcome.out;
  EXPECT_TRUE(json["animation_complete"].get<bool>());
  for (const auto& path : json["written"]) EXPECT_TRUE(fs::exists(path.get<std::string>())) << path;
  for (const char* name : {"animation.png", "contact_sheet.png", "error_by_bytes.png", "error_by_time.png"}) {
    expect_png(fs::path(out("p")) / name);
  }
  const auto session = nlohmann::json::parse(contents(out("p") + "/session.json"));
  EXPECT_EQ(names_in(out("p") + "/frames").size(), session["frames"].size());
  expect_png(out("p") + "/frames/frame_00000.png");
}

TEST_F(SessionProgram, AFolderMayBeNamedWithASlash) {
  const ProgramOutcome outcome =
      run({asset, "-o", out("slash") + "/", "--path", "orbit", "--fps", "1", "--size", "64x48", "--no-pictures"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.error;
  EXPECT_TRUE(fs::exists(out("slash") + "/session.json"));
  expect_failure({asset, "-o", out("none/slash") + "/", "--no-pictures"}, ErrorKind::not_found, "there is no folder");
}

TEST_F(SessionProgram, PlaysAPathFile) {
  const std::string path = folder
                               .write("path.json", R"({"keyframes": [
    {"time_s": 0, "eye": [0, 0, 4], "target": [0, 0, 0], "fov_deg": 40},
    {"time_s": 3, "eye": [4, 0, 0], "target": [0, 0, 0]}]})")
                               .string();
  const ProgramOutcome outcome =
      run({asset, "-o", out("f"), "--path", path, "--fps", "2", "--size", "64x48", "--no-pictures"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.error;
  EXPECT_EQ(nlohmann::json::parse(contents(out("f") + "/session.json"))["frames"].size(), 7U);
}

TEST_F(SessionProgram, BadOptionsSayWhatIsWrongAndWriteNothing) {
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {asset, "-o", out("bad")});
    return more;
  };
  expect_failure({asset}, ErrorKind::usage, "--output");
  expect_failure(with({"--fps", "0"}), ErrorKind::usage, "--fps");
  expect_failure(with({"--size", "0x5"}), ErrorKind::usage, "--size");
  expect_failure(with({"--tolerance-px", "-1"}), ErrorKind::usage, "--tolerance-px");
  expect_failure(with({"--link-mbit", "0"}), ErrorKind::usage, "--link-mbit");
  expect_failure(with({"--real-time", "--rtt-ms", "5"}), ErrorKind::usage, "--real-time");
  expect_failure(with({"--up", "0,0,0"}), ErrorKind::usage, "--up");
  expect_failure(with({"--triangles", "0"}), ErrorKind::usage, "--triangles");
  expect_failure({asset, "-o", asset, "--no-pictures"}, ErrorKind::usage, "is a file");
  expect_failure({out("none.fan"), "-o", out("bad"), "--no-pictures"}, ErrorKind::not_found, "none.fan");
  const std::string empty = folder.write("empty.fan", "").string();
  expect_failure({empty, "-o", out("bad"), "--no-pictures"}, ErrorKind::bad_input, "empty.fan");
}

TEST_F(SessionProgram, BadPathFilesAreNamedWithThePlace) {
  const auto with = [&](const std::string& path) {
    return std::vector<std::string>{asset, "-o", out("bad"), "--no-pictures", "--path", path};
  };
  expect_failure(with("spiral"), ErrorKind::not_found, "orbit");
  expect_failure(with(folder.write("cut.json", "{\"fps\": 1,").string()), ErrorKind::bad_input, "cut.json");
  expect_failure(with(folder.write("none.json", R"({"keyframes": []})").string()), ErrorKind::bad_input, "none.json");
  expect_failure(with(folder.write("other.json", "[]").string()), ErrorKind::bad_input, "other.json");
}

}  // namespace
}  // namespace fanstream
