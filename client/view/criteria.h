// What a camera asks of a piece of surface: how far it may appear off the original, and how much that matters.
//
// A piece of surface is known by a bounding sphere of the original (centre C, radius r), a cone of its normals, and the
// bound e of how far what is drawn may be off the original, in the model's units; often by a few smaller spheres too,
// of which the convex hull holds it. Two numbers come of it:
//
//   error_px(e)     what is *stated*: no point of the piece that can be seen is drawn further than this from where it
//                   belongs. No criterion changes it.
//   weighted_px(e)  what is *wanted*: weight * error_px(e), compared with the tolerance.
//
// Written in eye coordinates X (right), Y (up), Z (depth, along the view), with f = height_px / (2 tan(fov / 2)):
//
// *Projected error.* A point x with slope q = (X, Y) / Z that is drawn at y = x + d, |d| <= e, moves by
//     f |d_xy - q d_z| / Z(y)  <=  f e sqrt(1 + |q|^2) / Z(y)  =  f e / (cos(angle of x off the axis) Z(y)),
// and the same holds with x and y exchanged. One of the two is in the picture, at an angle of at most
// t = min(angle of C + asin((r + e) / |C|), angle of the picture's corner) off the axis; with c = cos t
//     error_px(e) = f e / (c max(near, Z(C) - r - e, c (|C| - r) - 2 e)).
// It holds for all pairs that are both at least `near` in front of the eye, which is what the renderer draws; where the
// eye is inside the sphere, `near` is what keeps it finite. It never falls as e rises.
//
// *Weight* = frustum * facing * focus point * focus direction, each 1 where its criterion is off:
//   frustum  1 where the sphere, e included, touches the picture; outside it falls linearly to `offscreen_weight` where
//            the gap, seen from the eye, has a sine of `frustum_falloff`.
//   facing   With axis a and half angle h of the cone, psi = angle(a, C - eye): all normals at all points of the sphere
//            face away if |C| cos(psi + h) > r, and face the eye if |C| cos(pi - psi + h) > r. What is neither may hold
//            the silhouette and has `silhouette_weight`; from there the weight goes linearly to `back_facing_weight` or
//            to 1 as (|C| cos(..) - r) / |C| rises to `facing_falloff`. Unknown cones have 1.
//   focus    see FocusPoint and FocusDirection.
// All are continuous in the camera: a trembling hand changes weights a little, and hysteresis covers that.
//
// *Parts.* Depth is linear in a point, a bound on the angle off the axis keeps convex sets, and so do each side of the
// frustum and `psi + h < 90 degrees` (a norm less a linear function). So what is least over the hull of some spheres is
// least at one of them: with centres C_i and radii r_i, Z(C) - r may be min Z(C_i) - r_i where that is more, c likewise
// by the largest of the parts' angles, and gaps and margins by the least of the parts'. A cell as large as a tenth of
// its distance is stated 3 to 5 % lower for it.
//
// Sources: Miura, Adachi, Ikedo, "sqrt(2)-subdivision" (view volume, front faces, silhouettes deeper); Odauchi,
// Tsukiji, real-time local simplification (distance to a point, angle to a direction). No I/O, no state; safe to call
// from any thread.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <span>

#include "client/view/camera.h"
#include "common/support/result.h"

namespace fanstream {

struct View {
  Camera camera;
  std::uint32_t width_px = 1024;
  std::uint32_t height_px = 768;
  // Nothing nearer in front of the eye is drawn: depth_range(camera, bounds).near_distance. Not above 0: a thousandth
  // of the distance from eye to target.
  double near_distance = 0.0;
};
bool operator==(const View& a, const View& b);

// Full weight for cells that come within `radius` of the point; from there it falls linearly to `outside_weight` over
// the distance `falloff` (0: as the radius).
struct FocusPoint {
  glm::dvec3 position{0.0};
  double radius = 0.0;
  double falloff = 0.0;
  double outside_weight = 0.1;
  friend bool operator==(const FocusPoint&, const FocusPoint&) = default;
};

// Full weight for cells of which a normal may come within `angle_deg` of `direction` (for what faces the camera: from
// target to eye); falls linearly to `outside_weight` over the next `falloff_deg`.
struct FocusDirection {
  glm::dvec3 direction{0.0, 0.0, 1.0};  // any length
  double angle_deg = 60.0;
  double falloff_deg = 30.0;
  double outside_weight = 0.1;
  friend bool operator==(const FocusDirection&, const FocusDirection&) = default;
};

// Weights are at least 0; 0 means not wanted. A weight w is as good as a tolerance of tolerance_px / w.
struct Criteria {
  bool use_frustum = true;
  double offscreen_weight = 0.0;
  double frustum_falloff = 0.05;     // about 3 degrees: what a turning camera shows next; 0: none
  bool use_facing = true;            // the weights of back faces and silhouettes
  double back_facing_weight = 0.25;  // not 0: a coarse back side sticks out behind the silhouette
  double silhouette_weight = 2.0;    // 1: no finer than front faces
  double facing_falloff = 0.1;
  std::optional<FocusPoint> focus_point;
  std::optional<FocusDirection> focus_direction;
  friend bool operator==(const Criteria&, const Criteria&) = default;
};

// Fails (usage) where the camera does (check_camera), or the picture has no pixels or more than 2^16 a side, or a
// number of the criteria is not finite or is negative, or a focus direction is zero.
Result<void> check_view(const View& view);
Result<void> check_criteria(const Criteria& criteria);

// A sphere around a piece of the original surface, and the cone that holds its normals.
struct CellExtent {
  glm::dvec3 center{0.0};
  double radius = 0.0;
  glm::dvec3 cone_axis{0.0, 0.0, 1.0};  // of length 1
  double cone_cosine = -1.0;            // of the half angle; -1: any direction, or not known
};

// One of some spheres of which the convex hull holds a piece of surface.
struct ExtentPart {
  glm::dvec3 center{0.0};
  double radius = 0.0;
};

// error_px as a function of the bound; see above.
struct ProjectedError {
  double scale_px = 0.0;  // f / c
  double depth = 0.0;     // Z(C) - r
  double slant = 0.0;     // c (|C| - r)
  double near = 1.0;
  double px(double error) const;
};

enum class Facing : std::uint8_t { unknown, front, back, mixed };

struct CellJudgement {
  ProjectedError error;
  double weight = 1.0;
  double weight_within = 1.0;  // of parts whose own bounds are not known yet: the silhouette does not count
  double area_px = 0.0;        // of the sphere on the picture, or of the whole picture if that is less
  bool in_frustum = true;
  Facing facing = Facing::unknown;
  // Counts for what is stated. Entirely back-facing cells are hidden but for where they stick out at the silhouette.
  bool can_be_seen() const { return in_frustum && facing != Facing::back; }
};

// What holds for a whole holds for its parts: tightens the part's judgement (not its weights) by that of a piece that
// it lies in. So refining hardly ever makes the stated error rise: only spheres, which widen as more of a cell is seen,
// may do so, by a little.
void narrow(CellJudgement& part, const CellJudgement& whole);

// A view and criteria prepared for many cells. Both must have passed their checks.
class ViewJudge {
 public:
  ViewJudge(const View& view, const Criteria& criteria);
  // `largest_error` is the largest bound that will be asked for: the projected error is valid up to it.
  // `parts`: none where nothing is known but the sphere.
  CellJudgement judge(const CellExtent& extent, double largest_error, std::span<const ExtentPart> parts = {}) const;
  // Of a piece that may be anywhere: as near as can be, and in the picture.
  CellJudgement anywhere() const;

 private:
  struct EyeSphere;
  // How far beyond the near plane and the four sides of the frustum something is at least; negative: within.
  using Gaps = std::array<double, 5>;
  EyeSphere eye_sphere(const glm::dvec3& center, double radius, double largest_error) const;
  Gaps gaps(const EyeSphere& sphere) const;
  double frustum_weight(double gap, double distance, CellJudgement& result) const;
  void facing_weights(const CellExtent& extent, std::span<const ExtentPart> parts, double distance,
                      CellJudgement& result) const;
  double focus_weight(const CellExtent& extent) const;

  Criteria criteria_;
  glm::dvec3 eye_{0.0};
  glm::dvec3 right_{0.0};
  glm::dvec3 up_{0.0};
  glm::dvec3 forward_{0.0};
  glm::dvec3 focus_direction_{0.0};
  double focal_px_ = 1.0;
  double tan_x_ = 1.0, tan_y_ = 1.0;    // of half the picture's angles
  double norm_x_ = 1.0, norm_y_ = 1.0;  // lengths of the side planes' normals, inverted
  double cos_corner_ = 1.0;
  double near_ = 1.0;
  double picture_area_px_ = 1.0;
};

}  // namespace fanstream
