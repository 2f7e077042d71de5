// A perspective camera in the model's own coordinates, right-handed, looking from eye to target.
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <span>

#include "common/mesh/triangle_mesh.h"
#include "common/support/result.h"

namespace fanstream {

struct Camera {
  glm::dvec3 eye{0.0, 0.0, 1.0};
  glm::dvec3 target{0.0};
  glm::dvec3 up{0.0, 1.0, 0.0};  // any length, not parallel to the view
  double fov_deg = 35.0;         // of the picture's height
};

// Fails (usage) where a number is not finite, the eye is on the target, up is zero or parallel to the view, or
// the field of view is outside [1, 170] degrees.
Result<void> check_camera(const Camera& camera);

// Where the model lies along the view: distances in front of the eye, 0 < near_distance < far_distance. Encloses the
// box; what is behind the eye or nearer than a thousandth of the far distance is cut off.
struct DepthRange {
  double near_distance = 0.1;
  double far_distance = 1.0;
};
DepthRange depth_range(const Camera& camera, const Bounds& bounds);

// Model to eye coordinates (right, up, backwards), and eye to OpenGL clip coordinates. The camera must pass
// check_camera.
glm::dmat4 view_matrix(const Camera& camera);
glm::dmat4 projection_matrix(const Camera& camera, double aspect, const DepthRange& depth);

// How `fit` looks at a model that nobody told it how to look at: y is up, and the eye stands in front (+z), a little to
// the right and above.
struct FitOptions {
  glm::dvec3 from{0.5, 0.4, 1.0};  // direction from the model to the eye
  glm::dvec3 up{0.0, 1.0, 0.0};
  double fov_deg = 35.0;
  double aspect = 4.0 / 3.0;  // width / height
  double margin = 0.05;       // share of the picture left free on each side
};

// The nearest camera that sees all points inside the margins, the model centred; a single point is seen from a distance
// of 1. The points may be a model's vertices (tight) or a box (Bounds). Points must be finite and the options sensible.
Camera fit(std::span<const glm::dvec3> points, const FitOptions& options = {});
Camera fit(const Bounds& bounds, const FitOptions& options = {});

}  // namespace fanstream
