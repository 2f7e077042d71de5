#include "client/session/camera_path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "client/session/built_in_paths.h"
#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::SeededRandom;

CameraKeyframe key(double time_s, const glm::dvec3& eye, const glm::dvec3& target = glm::dvec3(0.0)) {
  CameraKeyframe result;
  result.time_s = time_s;
  result.camera.eye = eye;
  result.camera.target = target;
  return result;
}

CameraPath path_of(std::vector<CameraKeyframe> keys) {
  CameraPath path;
  path.name = "path";
  path.keyframes = std::move(keys);
  return path;
}

void expect_near(const glm::dvec3& a, const glm::dvec3& b, double tolerance) {
  EXPECT_LE(glm::length(a - b), tolerance)
      << a.x << ' ' << a.y << ' ' << a.z << " is not " << b.x << ' ' << b.y << ' ' << b.z;
}

TEST(CameraPath, MeetsItsKeyframesAndStaysBeforeAndBehind) {
  CameraPath path = path_of({key(0, {0, 0, 3}), key(1, {4, 1, 0}, {1, 0, 0}), key(1.5, {-1, 5, 2})});
  path.keyframes[1].tolerance_px = 4.0;
  path.keyframes[2].camera.fov_deg = 60.0;
  ASSERT_TRUE(check_path(path));
  for (const CameraKeyframe& k : path.keyframes) {
    const PathView view = view_at(path, k.time_s);
    expect_near(view.camera.eye, k.camera.eye, 0.0);
    expect_near(view.camera.target, k.camera.target, 0.0);
    EXPECT_EQ(view.tolerance_px, k.tolerance_px);
  }
  expect_near(view_at(path, -1).camera.eye, {0, 0, 3}, 0.0);
  expect_near(view_at(path, 99).camera.eye, {-1, 5, 2}, 0.0);
  EXPECT_EQ(view_at(path, 0.5).tolerance_px, 2.5);
  EXPECT_EQ(view_at(path, 1.25).camera.fov_deg, 47.5);
}

TEST(CameraPath, IsContinuousAcrossKeyframes) {
  const CameraPath path =
      path_of({key(0, {0, 0, 3}), key(1, {4, 1, 0}), key(1.5, {-1, 5, 2}, {1, 0, 0}), key(4, {0, 0, 9})});
  for (const double time_s : {1.0, 1.5}) {
    const PathView before = view_at(path, time_s - 1e-7);
    const PathView after = view_at(path, time_s + 1e-7);
    expect_near(before.camera.eye, after.camera.eye, 1e-5);
    expect_near(before.camera.target, after.camera.target, 1e-5);
  }
}

// Directions a twelfth of a turn apart on the equator: great circles, so the turn is even to the last digits.
TEST(CameraPath, OrbitKeepsItsDistanceAndItsPace) {
  std::vector<CameraKeyframe> keys;
  const glm::dvec3 target(5, -2, 1);
  for (int i = 0; i <= 12; ++i) {
    const double angle = i * std::acos(-1.0) / 6;
    keys.push_back(key(i, target + 7.0 * glm::dvec3(std::sin(angle), 0, std::cos(angle)), target));
  }
  const CameraPath path = path_of(keys);
  for (double t = 0.0; t < 12.0; t += 0.037) {
    const glm::dvec3 from = view_at(path, t).camera.eye - target;
    EXPECT_NEAR(glm::length(from), 7.0, 1e-12);
    const double angle = t * std::acos(-1.0) / 6;
    expect_near(from / 7.0, {std::sin(angle), 0, std::cos(angle)}, 1e-9);
  }
}

TEST(CameraPath, ApproachHalvesTheDistanceInEqualTimes) {
  const CameraPath path = path_of({key(0, {0, 0, 16}), key(4, {0, 0, 1})});
  for (int i = 0; i <= 4; ++i) EXPECT_NEAR(view_at(path, i).camera.eye.z, std::pow(2.0, 4 - i), 1e-9);
}

TEST(CameraPath, WhatStandsStillDoesNotMove) {
  const CameraPath path =
      path_of({key(0, {0, 0, 3}, {1, 1, 0}), key(1, {5, 0, 0}), key(2, {5, 0, 0}), key(3, {9, 2, 2}, {3, 0, 0})});
  for (double t = 1.0; t <= 2.0; t += 0.05) {
    expect_near(view_at(path, t).camera.eye, {5, 0, 0}, 1e-12);
    expect_near(view_at(path, t).camera.target, {0, 0, 0}, 0.0);
  }
  // The eye stands, the target moves.
  const CameraPath turn =
      path_of({key(0, {1, 2, 3}, {0, 0, 0}), key(1, {1, 2, 3}, {5, 0, 0}), key(2, {1, 2, 3}, {5, 5, 0})});
  for (double t = 0.0; t <= 2.0; t += 0.1) expect_near(view_at(turn, t).camera.eye, {1, 2, 3}, 0.0);
}

TEST(CameraPath, CutHoldsTheViewBeforeAndBendsNoCurve) {
  CameraPath path = path_of({key(0, {0, 0, 3}), key(1, {3, 0, 0}), key(2, {0, 9, 1}), key(3, {0, 9, 2})});
  path.keyframes[2].cut = true;
  expect_near(view_at(path, 1.999).camera.eye, {3, 0, 0}, 0.0);
  expect_near(view_at(path, 2.0).camera.eye, {0, 9, 1}, 0.0);
  EXPECT_TRUE(has_cut(path, 1.9, 2.0));
  EXPECT_FALSE(has_cut(path, 2.0, 3.0));
  EXPECT_FALSE(has_cut(path, 0.0, 1.9));
  const CameraPath alone = path_of({path.keyframes[0], path.keyframes[1]});
  expect_near(view_at(path, 0.4).camera.eye, view_at(alone, 0.4).camera.eye, 0.0);
}

TEST(CameraPath, FocusMovesBetweenTwoThatHaveOne) {
  CameraPath path = path_of({key(0, {0, 0, 3}), key(1, {0, 0, 3}), key(2, {0, 0, 3})});
  path.keyframes[0].focus = FocusBall{{0, 0, 0}, 1};
  path.keyframes[1].focus = FocusBall{{2, 0, 0}, 3};
  EXPECT_EQ(view_at(path, 0.5).focus->radius, 2.0);
  expect_near(view_at(path, 0.5).focus->center, {1, 0, 0}, 0.0);
  EXPECT_EQ(view_at(path, 1.5).focus->radius, 3.0);
  EXPECT_FALSE(view_at(path, 2.0).focus);
}

TEST(CameraPath, FramesStandAtMultiplesOfTheirTimeUpToTheEnd) {
  CameraPath path = path_of({key(0, {0, 0, 3}), key(0.1, {3, 0, 0})});
  path.fps = 30;
  EXPECT_EQ(frame_count(path), 4U);  // 0.1 * 30 is less than 3 in doubles of some roundings
  EXPECT_EQ(frame_time_s(path, 3), 0.1);
  path.keyframes.resize(1);
  EXPECT_EQ(frame_count(path), 1U);
}

// Eyes through targets, opposite directions, ups along the view: whatever keyframes that are valid by themselves.
TEST(CameraPath, EveryViewBetweenValidKeyframesIsValid) {
  const std::uint64_t seed = 20;
  SeededRandom random(seed);
  const auto coordinate = [&random] { return static_cast<double>(random.between(-2, 2)); };
  int paths = 0;
  for (int i = 0; i < 2000; ++i) {
    std::vector<CameraKeyframe> keys;
    double time_s = 0.0;
    const double scale = std::pow(10.0, random.between(-30, 30));
    for (std::uint32_t k = 0; k < 2 + random.below(4); ++k) {
      CameraKeyframe next = key(time_s, {coordinate(), coordinate(), coordinate()}, {coordinate(), 0, 0});
      next.camera.eye *= scale;
      next.camera.target *= scale;
      next.camera.up = {coordinate(), coordinate(), coordinate()};
      next.cut = random.one_in(8);
      time_s += random.one_in(5) ? 1e-6 : 0.1 + random.unit();
      if (check_keyframe(next)) keys.push_back(next);
    }
    const CameraPath path = path_of(keys);
    if (keys.empty() || !check_path(path)) continue;
    ++paths;
    for (int sample = 0; sample <= 60; ++sample) {
      const PathView view = view_at(path, time_s * sample / 60.0);
      const Result<void> checked = check_camera(view.camera);
      ASSERT_TRUE(checked) << "seed " << seed << ", path " << i << ", sample " << sample << ": "
                           << checked.error().message;
    }
  }
  EXPECT_GT(paths, 1000);
}

TEST(CameraPath, RefusesWhatCannotBePlayed) {
  const auto message = [](const CameraPath& path) {
    const Result<void> checked = check_path(path);
    return checked ? std::string("accepted") : checked.error().message;
  };
  const CameraPath good = path_of({key(0, {0, 0, 3}), key(1, {3, 0, 0})});
  EXPECT_EQ(message(good), "accepted");
  EXPECT_EQ(message(path_of({})), "path: no keyframes");
  CameraPath bad = good;
  bad.keyframes[1].time_s = 0.0;
  EXPECT_EQ(message(bad), "path: keyframe 1: time of 0 s does not come after 0 s");
  bad = good;
  bad.keyframes[0].time_s = std::nan("");
  EXPECT_EQ(message(bad), "path: keyframe 0: time of nan s; 0 to 1000000000 can be had");
  bad = good;
  bad.keyframes[1].camera.eye.x = std::nan("");
  EXPECT_NE(message(bad).find("path: keyframe 1: camera: "), std::string::npos);
  bad = good;
  bad.keyframes[1].camera.eye = bad.keyframes[1].camera.target;
  EXPECT_NE(message(bad).find("must be different points"), std::string::npos);
  for (const double tolerance_px : std::vector<double>{0.0, -1.0, std::nan(""), INFINITY}) {
    bad = good;
    bad.keyframes[0].tolerance_px = tolerance_px;
    EXPECT_NE(message(bad).find("keyframe 0: tolerance of "), std::string::npos);
  }
  bad = good;
  bad.keyframes[0].focus = FocusBall{{0, 0, 0}, 0.0};
  EXPECT_NE(message(bad).find("focus: "), std::string::npos);
  bad = good;
  bad.fps = 1000;
  EXPECT_NE(message(bad).find("1000 frames a second"), std::string::npos);
  bad = good;
  bad.width = 0;
  EXPECT_NE(message(bad).find("0x768"), std::string::npos);
  bad = good;
  bad.keyframes[1].time_s = 1e8;
  EXPECT_EQ(check_path(bad).error().kind, ErrorKind::limit);
  bad.keyframes.assign(kMostKeyframes + 1, key(0, {0, 0, 3}));
  EXPECT_EQ(check_path(bad).error().kind, ErrorKind::limit);
}

std::vector<std::pair<std::string, Bounds>> all_bounds() {
  return {{"a unit box", {{-1, -1, -1}, {1, 1, 1}}},
          {"flat", {{-3, 0, -1}, {5, 0, 2}}},
          {"a line", {{0, 0, 0}, {0, 8, 0}}},
          {"one point", {{4, 5, 6}, {4, 5, 6}}},
          {"the origin", {{0, 0, 0}, {0, 0, 0}}},
          {"tiny", {{0, 0, 0}, {1e-80, 2e-80, 1e-80}}},
          {"tiny and far away", {{1e6, 1e6, 0}, {1e6 + 1e-9, 1e6 + 1e-9, 1e-9}}},
          {"huge", {{-1e80, -1e80, 0}, {1e80, 1e80, 1e80}}},
          {"the largest", {{-1.7e308, -1.7e308, -1.7e308}, {1.7e308, 1.7e308, 1.7e308}}},
          {"the smallest", {{0, 0, 0}, {5e-324, 5e-324, 5e-324}}}};
}

TEST(BuiltInPaths, AreValidForAllBounds) {
  for (const auto& [what, bounds] : all_bounds()) {
    for (const glm::dvec3& up : {glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 2), glm::dvec3(1, 0, 0), glm::dvec3(1, -2, 3)}) {
      for (const std::string_view name : kBuiltInPaths) {
        BuiltInPathOptions options;
        options.up = up;
        const std::optional<CameraPath> path = built_in_path(name, bounds, options);
        ASSERT_TRUE(path) << name;
        const Result<void> checked = check_path(*path);
        ASSERT_TRUE(checked) << name << " around " << what << ": " << checked.error().message;
        for (std::size_t i = 0; i < frame_count(*path); ++i) {
          ASSERT_TRUE(check_camera(view_at(*path, frame_time_s(*path, i)).camera)) << name << " around " << what;
        }
      }
    }
  }
  EXPECT_FALSE(built_in_path("loop", {}));
}

// Share of the picture's half size at which a point appears: 1 is the border.
double place_in_picture(const CameraPath& path, const Camera& camera, const glm::dvec3& point) {
  const glm::dvec4 eye = view_matrix(camera) * glm::dvec4(point, 1.0);
  const double slope = std::tan(camera.fov_deg * std::acos(-1.0) / 360.0);
  if (eye.z >= 0.0) return INFINITY;
  return std::max(std::abs(eye.y) / (-eye.z * slope), std::abs(eye.x) / (-eye.z * slope * path.width / path.height));
}

TEST(BuiltInPaths, OrbitSeesAllOfTheModelAndFillsThePictureWithIt) {
  const Bounds bounds{{-1, -2, -3}, {4, 1, 2}};
  const CameraPath path = orbit_path(bounds);
  double largest = 0.0;
  for (std::size_t i = 0; i < frame_count(path); ++i) {
    const Camera camera = view_at(path, frame_time_s(path, i)).camera;
    for (unsigned corner = 0; corner < 8; ++corner) {
      const glm::dvec3 p((corner & 1U) != 0 ? 4 : -1, (corner & 2U) != 0 ? 1 : -2, (corner & 4U) != 0 ? 2 : -3);
      largest = std::max(largest, place_in_picture(path, camera, p));
    }
  }
  EXPECT_LT(largest, 0.95);
  EXPECT_GT(largest, 0.85);
}

TEST(BuiltInPaths, TheEyeStaysOutsideTheBox) {
  const Bounds bounds{{-1, -2, -3}, {4, 1, 2}};
  for (const std::string_view name : kBuiltInPaths) {
    const CameraPath path = *built_in_path(name, bounds);
    for (std::size_t i = 0; i < frame_count(path); ++i) {
      const glm::dvec3 eye = view_at(path, frame_time_s(path, i)).camera.eye;
      const bool inside = eye.x > -1 && eye.x < 4 && eye.y > -2 && eye.y < 1 && eye.z > -3 && eye.z < 2;
      ASSERT_FALSE(inside) << name << ", frame " << i;
    }
  }
}

TEST(BuiltInPaths, JumpIsTwoStillViewsOfOppositeSides) {
  const CameraPath path = jump_path({{-1, -1, -1}, {1, 1, 1}});
  std::size_t cuts = 0;
  for (std::size_t i = 1; i < frame_count(path); ++i) {
    const glm::dvec3 a = view_at(path, frame_time_s(path, i - 1)).camera.eye;
    const glm::dvec3 b = view_at(path, frame_time_s(path, i)).camera.eye;
    const bool cut = has_cut(path, frame_time_s(path, i - 1), frame_time_s(path, i));
    EXPECT_EQ(cut, a != b);
    if (cut) {
      EXPECT_LT(glm::dot(glm::normalize(a), glm::normalize(b)), -0.8);
    }
    cuts += cut ? 1 : 0;
  }
  EXPECT_EQ(cuts, 1U);
}

}  // namespace
}  // namespace fanstream
