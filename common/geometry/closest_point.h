// The point of a triangle that lies closest to a given point.
#pragma once

#include <glm/vec3.hpp>

namespace fanstream {

// The closest point to `query` on the segment from `a` to `b`, which may be of length zero.
glm::dvec3 closest_point_on_segment(const glm::dvec3& query, const glm::dvec3& a, const glm::dvec3& b);

// The closest point to `query` on the triangle a, b, c. Needles and degenerate triangles (all corners on a line or in
// one point) are handled as what they are, without a threshold.
// After Ericson, Real-Time Collision Detection, section 5.1.5, with "inside" decided by signed areas from the cross
// product instead of differences of dot products, which lose half of the digits on needles.
// All coordinates must be finite and below 1e70 in magnitude.
glm::dvec3 closest_point_on_triangle(const glm::dvec3& query, const glm::dvec3& a, const glm::dvec3& b,
                                     const glm::dvec3& c);

}  // namespace fanstream
