#include "client/session/camera_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>

#include "client/render/offscreen_renderer.h"

namespace fanstream {
namespace {

// The spaces that curves run in: the way from one point to another, a point moved by a way, a point between two, and
// how long a way a control point may go when the step is so long.
template <class Point>
struct Flat {
  static Point way(const Point& from, const Point& to) { return to - from; }
  static Point moved(const Point& from, const Point& way) { return from + way; }
  static Point between(const Point& a, const Point& b, double t) { return a + (b - a) * t; }
  static double size(double way) { return std::abs(way); }
  static double size(const glm::dvec3& way) { return glm::length(way); }
  static double reach(double step) { return 0.5 * step; }
};

glm::dvec3 perpendicular_to(const glm::dvec3& unit) {
  const glm::dvec3 a = glm::abs(unit);
  const glm::dvec3 axis = a.x <= a.y && a.x <= a.z ? glm::dvec3(1, 0, 0)
                          : a.y <= a.z             ? glm::dvec3(0, 1, 0)
                                                   : glm::dvec3(0, 0, 1);
  return glm::normalize(glm::cross(unit, axis));
}

// Unit vectors; ways are tangent vectors as long as the angle.
struct Sphere {
  static glm::dvec3 way(const glm::dvec3& from, const glm::dvec3& to) {
    const double cosine = glm::dot(from, to);
    const glm::dvec3 across = to - from * cosine;
    const double sine = glm::length(across);
    const double angle = std::atan2(sine, cosine);
    if (sine < 1e-12) return angle < 1.0 ? glm::dvec3(0.0) : perpendicular_to(from) * angle;
    return across * (angle / sine);
  }
  static glm::dvec3 moved(const glm::dvec3& from, const glm::dvec3& way) {
    const double angle = glm::length(way);
    if (angle == 0.0) return from;
    return glm::normalize(from * std::cos(angle) + way * (std::sin(angle) / angle));
  }
  static glm::dvec3 between(const glm::dvec3& a, const glm::dvec3& b, double t) { return moved(a, way(a, b) * t); }
  static double size(const glm::dvec3& way) { return glm::length(way); }
  // The two control points stay less than half a turn apart.
  static double reach(double step) { return std::min(0.5 * step, 0.45 * (std::numbers::pi - step)); }
};

// Two keyframes and those beside them, as far as the curve takes account of them.
template <class Point>
struct Stretch {
  Point begin, end;
  double duration_s = 1.0;
  std::optional<std::pair<Point, double>> before{}, after{};  // with the time to them
};

// The control point beside `here`, by the tangent of the parabola through three points.
template <class Space, class Point>
Point control(const Point& here, const Point& there, double duration_s,
              const std::optional<std::pair<Point, double>>& beyond) {
  const Point step = Space::way(here, there);
  Point way = step;
  if (beyond) {
    const double whole_s = duration_s + beyond->second;
    way = step * (beyond->second / whole_s) -
          Space::way(here, beyond->first) * (duration_s / beyond->second * (duration_s / whole_s));
  }
  way = way * (1.0 / 3.0);
  const double reach = Space::reach(Space::size(step));
  const double size = Space::size(way);
  if (size > reach) way = way * (reach / size);
  return Space::moved(here, way);
}

template <class Space, class Point>
Point curve(const Stretch<Point>& s, double t) {
  const Point first = control<Space>(s.begin, s.end, s.duration_s, s.before);
  const Point second = control<Space>(s.end, s.begin, s.duration_s, s.after);
  const Point a = Space::between(s.begin, first, t);
  const Point b = Space::between(first, second, t);
  const Point c = Space::between(second, s.end, t);
  return Space::between(Space::between(a, b, t), Space::between(b, c, t), t);
}

glm::dvec3 direction(const Camera& camera) { return glm::normalize(camera.eye - camera.target); }
double log_distance(const Camera& camera) { return std::log(glm::length(camera.eye - camera.target)); }

// The stretch from keyframe `from` to the next, of what `value` makes of their cameras. Neighbours behind a cut, or
// that `counts` refuses, have no say.
template <class Value, class Counts>
auto stretch(const std::vector<CameraKeyframe>& keys, std::size_t from, Value&& value, Counts&& counts) {
  const CameraKeyframe& a = keys[from];
  const CameraKeyframe& b = keys[from + 1];
  Stretch<decltype(value(a.camera))> result{value(a.camera), value(b.camera), b.time_s - a.time_s};
  if (from > 0 && !a.cut && counts(keys[from - 1].camera)) {
    result.before.emplace(value(keys[from - 1].camera), a.time_s - keys[from - 1].time_s);
  }
  if (from + 2 < keys.size() && !keys[from + 2].cut && counts(keys[from + 2].camera)) {
    result.after.emplace(value(keys[from + 2].camera), keys[from + 2].time_s - b.time_s);
  }
  return result;
}

void move_eye(const std::vector<CameraKeyframe>& keys, std::size_t from, double t, Camera& camera) {
  const glm::dvec3& target = keys[from].camera.target;
  if (keys[from + 1].camera.target == target) {
    const auto around = [&target](const Camera& other) { return other.target == target; };
    const glm::dvec3 to_eye = curve<Sphere>(stretch(keys, from, direction, around), t);
    const double distance = std::exp(curve<Flat<double>>(stretch(keys, from, log_distance, around), t));
    camera.target = target;
    camera.eye = target + to_eye * distance;
    return;
  }
  const auto all = [](const Camera&) { return true; };
  camera.eye = curve<Flat<glm::dvec3>>(stretch(
                                           keys, from, [](const Camera& c) { return c.eye; }, all),
                                       t);
  camera.target = curve<Flat<glm::dvec3>>(stretch(
                                              keys, from, [](const Camera& c) { return c.target; }, all),
                                          t);
}

// A camera that shows something, as near to the given one as may be.
Camera settled(const Camera& camera, const Camera& nearer) {
  if (check_camera(camera)) return camera;
  Camera changed = camera;
  const double distance = glm::length(camera.eye - camera.target);
  if (!(distance > 0.0)) changed.target = camera.eye + (nearer.target - nearer.eye);
  if (check_camera(changed)) return changed;
  changed.up = nearer.up;
  if (check_camera(changed)) return changed;
  const double view = glm::length(changed.target - changed.eye);
  if (view > 0.0) changed.up = perpendicular_to((changed.target - changed.eye) / view);
  return check_camera(changed) ? changed : nearer;
}

PathView view_of(const CameraKeyframe& key) { return {key.camera, key.tolerance_px, key.focus}; }

bool within(const glm::dvec3& v) {
  const glm::dvec3 a = glm::abs(v);
  return a.x <= kLargestCoordinate && a.y <= kLargestCoordinate && a.z <= kLargestCoordinate;  // false for NaN
}

}  // namespace

Result<void> check_picture(const CameraPath& path) {
  if (!(path.fps >= 0.1 && path.fps <= 240.0)) {
    return fail(ErrorKind::usage, fmt::format("{}: {} frames a second; 0.1 to 240 can be had", path.name, path.fps));
  }
  constexpr std::uint32_t kLargest = OffscreenRenderer::kLargestSidePx;
  const std::uint64_t pixels = std::uint64_t{path.width} * path.height;
  if (pixels == 0 || path.width > kLargest || path.height > kLargest || pixels > OffscreenRenderer::kMostPixels) {
    return fail(ErrorKind::usage,
                fmt::format("{}: a picture of {}x{} pixels; each side is 1 to {}, and {} pixels are the most",
                            path.name, path.width, path.height, kLargest, OffscreenRenderer::kMostPixels));
  }
  return {};
}

Result<void> check_keyframe(const CameraKeyframe& key) {
  if (!within(key.camera.eye) || !within(key.camera.target) || !within(key.camera.up)) {
    return fail(ErrorKind::usage,
                fmt::format("camera: eye, target and up must be finite numbers up to {}", kLargestCoordinate));
  }
  if (const auto checked = check_camera(key.camera); !checked) return checked;
  if (!(key.tolerance_px > 0.0 && key.tolerance_px <= 10'000.0)) {
    return fail(ErrorKind::usage,
                fmt::format("tolerance of {} px; it must be above 0 and at most 10000", key.tolerance_px));
  }
  if (key.focus && !(within(key.focus->center) && key.focus->radius > 0.0 && key.focus->radius <= kLargestCoordinate)) {
    return fail(ErrorKind::usage, "focus: needs a finite centre and a radius above 0");
  }
  return {};
}

Result<void> check_path(const CameraPath& path) {
  if (const auto checked = check_picture(path); !checked) return checked;
  if (path.keyframes.empty()) return fail(ErrorKind::usage, path.name + ": no keyframes");
  if (path.keyframes.size() > kMostKeyframes) {
    return fail(ErrorKind::limit,
                fmt::format("{}: {} keyframes, {} are the most", path.name, path.keyframes.size(), kMostKeyframes));
  }
  double last_s = -1.0;
  for (std::size_t i = 0; i < path.keyframes.size(); ++i) {
    const CameraKeyframe& key = path.keyframes[i];
    const std::string where = fmt::format("{}: keyframe {}", path.name, i);
    if (!(key.time_s >= 0.0 && key.time_s <= kLatestTimeS)) {
      return fail(ErrorKind::usage,
                  fmt::format("{}: time of {} s; 0 to {} can be had", where, key.time_s, kLatestTimeS));
    }
    if (!(key.time_s > last_s)) {
      return fail(ErrorKind::usage,
                  fmt::format("{}: time of {} s does not come after {} s", where, key.time_s, last_s));
    }
    last_s = key.time_s;
    if (const auto checked = check_keyframe(key); !checked) return tl::unexpected(with_context(checked.error(), where));
  }
  if (last_s * path.fps >= static_cast<double>(kMostPathFrames)) {
    return fail(ErrorKind::limit, fmt::format("{}: {} s at {} frames a second are more than {} frames", path.name,
                                              last_s, path.fps, kMostPathFrames));
  }
  return {};
}

std::size_t frame_count(const CameraPath& path) {
  // A last keyframe at 0.1 s is met by frame 3 at 30 a second, whatever 0.1 * 30 rounds to.
  return static_cast<std::size_t>(std::floor(path.keyframes.back().time_s * path.fps + 1e-6)) + 1;
}

double frame_time_s(const CameraPath& path, std::size_t frame) { return static_cast<double>(frame) / path.fps; }

bool has_cut(const CameraPath& path, double from_s, double to_s) {
  const auto after = [](double time_s, const CameraKeyframe& key) { return time_s < key.time_s; };
  auto key = std::upper_bound(path.keyframes.begin(), path.keyframes.end(), from_s, after);
  for (; key != path.keyframes.end() && key->time_s <= to_s; ++key) {
    if (key->cut) return true;
  }
  return false;
}

PathView view_at(const CameraPath& path, double time_s) {
  const std::vector<CameraKeyframe>& keys = path.keyframes;
  const auto next = std::upper_bound(keys.begin(), keys.end(), time_s,
                                     [](double time, const CameraKeyframe& key) { return time < key.time_s; });
  if (next == keys.begin()) return view_of(keys.front());
  const CameraKeyframe& a = *(next - 1);
  if (next == keys.end() || next->cut || time_s == a.time_s) return view_of(a);
  const CameraKeyframe& b = *next;
  const double t = (time_s - a.time_s) / (b.time_s - a.time_s);
  PathView view = view_of(a);
  move_eye(keys, static_cast<std::size_t>(next - 1 - keys.begin()), t, view.camera);
  view.camera.up = Sphere::between(glm::normalize(a.camera.up), glm::normalize(b.camera.up), t);
  view.camera.fov_deg = Flat<double>::between(a.camera.fov_deg, b.camera.fov_deg, t);
  view.tolerance_px = Flat<double>::between(a.tolerance_px, b.tolerance_px, t);
  if (a.focus && b.focus) {
    view.focus = FocusBall{Flat<glm::dvec3>::between(a.focus->center, b.focus->center, t),
                           Flat<double>::between(a.focus->radius, b.focus->radius, t)};
  }
  view.camera = settled(view.camera, t < 0.5 ? a.camera : b.camera);
  return view;
}

}  // namespace fanstream
