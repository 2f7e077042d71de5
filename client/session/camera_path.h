// A camera that moves: keyframes in time and what is seen between them.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/view/camera.h"
#include "common/support/result.h"

namespace fanstream {

// Where the viewer looks closest: a ball in the model's coordinates.
struct FocusBall {
  glm::dvec3 center{0.0};
  double radius = 1.0;
};

struct CameraKeyframe {
  double time_s = 0.0;
  Camera camera;
  double tolerance_px = 1.0;
  std::optional<FocusBall> focus{};
  bool cut = false;  // the view before stays until time_s, then this one is there at once
};

struct CameraPath {
  std::string name;  // a file's path, or "orbit"
  double fps = 25.0;
  std::uint32_t width = 1024;
  std::uint32_t height = 768;
  std::vector<CameraKeyframe> keyframes;
};

struct PathView {
  Camera camera;
  double tolerance_px = 1.0;
  std::optional<FocusBall> focus{};
};

inline constexpr std::size_t kMostKeyframes = 10'000;
inline constexpr std::size_t kMostPathFrames = 100'000;
inline constexpr double kLargestCoordinate = 1e100;
inline constexpr double kLatestTimeS = 1e9;

// Every rule that a keyframe keeps by itself: finite numbers, no coordinate beyond kLargestCoordinate, a camera that
// passes check_camera, a tolerance above 0 and at most 10,000 px, a focus whose radius is above 0. Errors (usage) say
// which.
Result<void> check_keyframe(const CameraKeyframe& keyframe);

// 0.1 to 240 frames a second, and a picture that OffscreenRenderer can draw. Errors (usage) begin with the path's name.
Result<void> check_picture(const CameraPath& path);

// The whole path: 1 to kMostKeyframes keyframes that each pass check_keyframe, times from 0 to
// kLatestTimeS that rise, what check_picture asks for, at most kMostPathFrames frames. Errors (usage, limit)
// begin with the path's name and name the keyframe, counted from 0.
Result<void> check_path(const CameraPath& path);

// Preconditions of all below: check_path succeeded.

// Frames stand at 0, 1/fps, 2/fps, ... up to the last keyframe's time; at least one.
std::size_t frame_count(const CameraPath& path);
double frame_time_s(const CameraPath& path, std::size_t frame);
// Whether a cut lies in (from_s, to_s].
bool has_cut(const CameraPath& path, double from_s, double to_s);

// What is seen at a time; before the first and after the last keyframe theirs. The camera passes check_camera.
//
// Between two keyframes that look at the same target the eye turns around it: its direction follows a cubic Bezier
// curve on the sphere, the logarithm of its distance one on the line, so an orbit keeps its distance and an approach
// takes equal time for each halving. Otherwise eye and target follow cubics in space each for itself. All tangents are
// Catmull-Rom's for unequal times (the parabola through three keyframes), cut down so that no control point lies
// further from its keyframe than half the step: what stands still at both ends of a step does not move in between. Up
// turns evenly, field of view, tolerance and focus change linearly; a focus that only one of two keyframes has belongs
// to the former's time. Where the curves would make no view (eye on target, up along the view), the nearer keyframe's
// target, up or camera takes its place.
PathView view_at(const CameraPath& path, double time_s);

}  // namespace fanstream
