// Where a camera puts points, by the matrices that the renderer draws with: a measure apart from what criteria.h says.
#pragma once

#include <cmath>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "client/view/criteria.h"

namespace fanstream::testing {

class Projection {
 public:
  explicit Projection(const View& view)
      : to_eye_(view_matrix(view.camera)),
        to_clip_(projection_matrix(view.camera, static_cast<double>(view.width_px) / view.height_px, {0.1, 10.0})),
        half_size_(view.width_px / 2.0, view.height_px / 2.0),
        near_(view.near_distance) {}

  double depth(const glm::dvec3& p) const { return -(to_eye_ * glm::dvec4(p, 1.0)).z; }
  bool is_drawn(const glm::dvec3& p) const { return depth(p) >= near_; }
  // From the picture's centre; only for what is in front of the eye. The depth range has no part in it.
  glm::dvec2 pixel(const glm::dvec3& p) const {
    const glm::dvec4 clip = to_clip_ * (to_eye_ * glm::dvec4(p, 1.0));
    return glm::dvec2(clip.x, clip.y) / clip.w * half_size_;
  }
  bool is_inside(const glm::dvec2& pixel) const {
    return std::abs(pixel.x) <= half_size_.x && std::abs(pixel.y) <= half_size_.y;
  }
  bool in_picture(const glm::dvec3& p) const { return is_inside(pixel(p)); }

 private:
  glm::dmat4 to_eye_, to_clip_;
  glm::dvec2 half_size_;
  double near_;
};

}  // namespace fanstream::testing
