// A focus among boxes, four at a time.
#pragma once

#include "client/collision/focus.h"
#include "client/collision/four_boxes.h"

namespace fanstream {

// Keeps a reference to the test. Thread safe.
class FocusBoxes {
 public:
  FocusBoxes(const FocusTest& focus, const BoxFrame& frame);
  // The boxes that a triangle in focus may reach into, as bits; no empty one. Normals are not asked about.
  std::uint32_t touched(const FourBoxes& boxes) const {
    Float4 sum = float4(0.0F);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Float4 at = float4(centre_[static_cast<int>(axis)]);
      const Float4 gap = upper(upper(boxes.ends[axis] - at, at - boxes.ends[3 + axis]), float4(0.0F));
      sum += gap * gap;
    }
    const std::uint32_t lanes = lane_bits(boxes.filled() & mask_of(sum <= float4(square_)));
    return focus_.region() ? in_region(boxes, lanes) : lanes;
  }

 private:
  std::uint32_t in_region(const FourBoxes& boxes, std::uint32_t lanes) const;

  const FocusTest& focus_;
  BoxFrame frame_;
  // The sphere, a little larger than it is; without one, all there is.
  glm::vec3 centre_{0.0F};
  float square_ = std::numeric_limits<float>::infinity();
};

}  // namespace fanstream
