#include "client/session/camera_path_file.h"

#include <gtest/gtest.h>

#include "tests/support/seeded_random.h"
#include "tests/support/temporary_folder.h"

namespace fanstream {
namespace {

using testing::SeededRandom;
using testing::TemporaryFolder;

const std::string kGood = R"({
  "fps": 12.5,
  "size_px": [640, 480],
  "keyframes": [
    {"time_s": 0, "eye": [0, 0, 3], "target": [0, 0, 0], "tolerance_px": 2},
    {"time_s": 1.5e0,
     "eye": [3, 0.5, -1],
     "target": [0, 0, 0],
     "fov_deg": 50,
     "focus": [1, 2, 3, 0.5], "cut": true},
    {"time_s": 2, "eye": [3, 0.5, 0], "target": [1, 0, 0], "up": [0, 0, 1]},
    {"time_s": 3, "eye": [3, 0.5, 0], "target": [1, 0, 0], "focus": null}
  ]
})";

// The good file with one text replaced by another.
std::string with(const std::string& what, const std::string& by) {
  std::string text = kGood;
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

std::string message(const std::string& text) {
  const Result<CameraPath> path = parse_camera_path(text, "p.json");
  return path ? "accepted" : path.error().message;
}

TEST(CameraPathFile, IsReadWithWhatItLeavesOut) {
  const Result<CameraPath> path = parse_camera_path(kGood, "p.json");
  ASSERT_TRUE(path) << path.error().message;
  EXPECT_EQ(path->fps, 12.5);
  EXPECT_EQ(path->width, 640U);
  EXPECT_EQ(path->height, 480U);
  ASSERT_EQ(path->keyframes.size(), 4U);
  EXPECT_EQ(path->keyframes[0].camera.fov_deg, 35.0);
  EXPECT_EQ(path->keyframes[1].time_s, 1.5);
  EXPECT_EQ(path->keyframes[1].camera.eye, glm::dvec3(3, 0.5, -1));
  EXPECT_EQ(path->keyframes[1].tolerance_px, 2.0);  // as before
  EXPECT_TRUE(path->keyframes[1].cut);
  EXPECT_FALSE(path->keyframes[2].cut);
  EXPECT_EQ(path->keyframes[2].focus->radius, 0.5);
  EXPECT_EQ(path->keyframes[2].camera.fov_deg, 50.0);
  EXPECT_EQ(path->keyframes[3].camera.up, glm::dvec3(0, 0, 1));
  EXPECT_FALSE(path->keyframes[3].focus);
  EXPECT_EQ(message("\xEF\xBB\xBF" + kGood), "accepted");
}

TEST(CameraPathFile, ErrorsNameLineAndKey) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {with("\"eye\": [3, 0.5, -1]", "\"eye\": [3, 0.5]"),
       "p.json: line 7: keyframes[1].eye: expected an array of 3 numbers"},
      {with("\"eye\": [3, 0.5, -1]", "\"eye\": [3, 0.5, \"x\"]"),
       "p.json: line 7: keyframes[1].eye: expected an array of 3 numbers"},
      {with("\"target\": [0, 0, 0],\n", "\n"), "p.json: line 6: keyframes[1].target: is missing"},
      {with("\"fov_deg\": 50", "\"fov_deg\": \"wide\""), "p.json: line 9: keyframes[1].fov_deg: expected a number"},
      {with("\"fov_deg\": 50", "\"fov_deg\": 171"),
       "p.json: line 9: keyframes[1]: camera: field of view 171 is outside 1 to 170 degrees"},
      {with("\"fov_deg\"", "\"fov\""),
       "p.json: line 9: keyframes[1]: unknown key \"fov\"; there are time_s, eye, target, up, fov_deg, tolerance_px, "
       "focus, cut"},
      {with("\"fps\"", "\"frames\""), "p.json: line 2: unknown key \"frames\"; there are fps, size_px, keyframes"},
      {with("\"time_s\": 2", "\"time_s\": 1.5"),
       "p.json: line 11: keyframes[2].time_s: is 1.5, must be more than 1.5, the time before"},
      {with("\"time_s\": 0", "\"time_s\": -1"), "p.json: line 5: keyframes[0].time_s: is -1, must be 0 or more"},
      {with("\"tolerance_px\": 2", "\"tolerance_px\": 0"),
       "p.json: line 5: keyframes[0]: tolerance of 0 px; it must be above 0 and at most 10000"},
      {with("[1, 2, 3, 0.5]", "[1, 2, 3, -0.5]"),
       "p.json: line 10: keyframes[1]: focus: needs a finite centre and a radius above 0"},
      {with("\"cut\": true", "\"cut\": 1"), "p.json: line 10: keyframes[1].cut: expected true or false"},
      {with("640", "0.5"), "p.json: line 3: size_px: 0.5 is no number of pixels"},
      {with("640", "100000"),
       "p.json: line 3: size_px: a picture of 100000x480 pixels; each side is 1 to 8192, and 16777216 pixels are the "
       "most"},
      {with("12.5", "0"), "p.json: line 2: fps: 0 frames a second; 0.1 to 240 can be had"},
      {with("\"cut\": true", "\"cut\": true, \"cut\": true"), "p.json: line 10: key \"cut\" is given twice"},
      {with("\"time_s\": 3", "\"time_s\": 3e300"),
       "p.json: line 12: keyframes[3].time_s: keyframe 3: time of 3e+300 s; 0 to 1000000000 can be had"},
      {with("\"time_s\": 3", "\"time_s\": 30000"),
       "p.json: line 12: keyframes[3].time_s: 30000 s at 12.5 frames a second are more than 100000 frames"},
      {"[]", "p.json: line 1: expected an object with keyframes"},
      {"{}", "p.json: line 1: keyframes: is missing"},
      {"{\"keyframes\": []}", "p.json: line 1: keyframes: no keyframes"},
      {"{\"keyframes\": [\n3]}", "p.json: line 2: keyframes[0]: expected an object"}};
  for (const auto& [text, expected] : cases) EXPECT_EQ(message(text), expected);
}

TEST(CameraPathFile, WhatIsNotJsonIsRefusedWithItsLine) {
  EXPECT_NE(message(with("\"fov_deg\": 50,", "\"fov_deg\": 50")).find("p.json: line 10: not JSON: "), std::string::npos)
      << message(with("\"fov_deg\": 50,", "\"fov_deg\": 50"));
  EXPECT_NE(message(with("1.5e0", "1e999")).find("p.json: line 6: not JSON: number overflow"), std::string::npos)
      << message(with("1.5e0", "1e999"));
  EXPECT_NE(message(with("1.5e0", "NaN")).find("p.json: line 6: not JSON: "), std::string::npos);
  EXPECT_NE(message("").find("p.json: line 1: not JSON: "), std::string::npos);
  EXPECT_NE(message(kGood + "x").find("not JSON"), std::string::npos);
}

TEST(CameraPathFile, LimitsHoldBeforeMemoryIsTaken) {
  const auto kind = [](const std::string& text) { return parse_camera_path(text, "p.json").error().kind; };
  EXPECT_EQ(kind(std::string(kMostPathFileBytes + 1, ' ')), ErrorKind::limit);
  EXPECT_EQ(kind(std::string(1'000'000, '[')), ErrorKind::limit);
  std::string many = "{\"keyframes\": [0";
  for (std::size_t i = 0; i < kMostKeyframes; ++i) many += ",0";
  EXPECT_EQ(kind(many + "]}"), ErrorKind::limit);
  std::string keys = "{";
  for (int i = 0; i < 300; ++i) keys += "\"k" + std::to_string(i) + "\": 0,";
  EXPECT_EQ(kind(keys + "\"z\": 0}"), ErrorKind::limit);
  EXPECT_EQ(kind(with("\"time_s\": 3", "\"time_s\": 1e8")), ErrorKind::limit);
}

TEST(CameraPathFile, IsReadFromDisk) {
  const TemporaryFolder folder;
  const Result<CameraPath> path = read_camera_path(folder.write("walk.json", kGood));
  ASSERT_TRUE(path) << path.error().message;
  EXPECT_EQ(path->name, (folder.path() / "walk.json").string());
  EXPECT_EQ(read_camera_path(folder.path() / "none.json").error().kind, ErrorKind::not_found);
  EXPECT_EQ(read_camera_path(folder.path()).error().kind, ErrorKind::io);
  EXPECT_EQ(read_camera_path("/dev/zero").error().kind, ErrorKind::limit);  // has no end
}

// Every path that is read can be played, whatever became of the file; every error names the file.
TEST(CameraPathFile, DamagedFilesAreErrorsOrGoodPaths) {
  const std::uint64_t seed = 8;
  SeededRandom random(seed);
  int accepted = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string text = kGood;
    for (std::uint32_t edit = 0; edit <= random.below(3); ++edit) {
      const std::size_t at = random.below(text.size());
      switch (random.below(4)) {
        case 0: text[at] = static_cast<char>(random.below(256)); break;
        case 1: text.erase(at, 1 + random.below(9)); break;
        case 2: text[at] = "0123456789-.e[]{}\",:"[random.below(20)]; break;
        default: text.insert(at, text.substr(random.below(text.size()), random.below(30))); break;
      }
    }
    const Result<CameraPath> path = parse_camera_path(text, "p.json");
    if (path) {
      ++accepted;
      ASSERT_TRUE(check_path(*path)) << "seed " << seed << ", file " << i;
    } else {
      ASSERT_EQ(path.error().message.substr(0, 13), "p.json: line ") << "seed " << seed << ", file " << i;
    }
  }
  EXPECT_GT(accepted, 100);
}

}  // namespace
}  // namespace fanstream
