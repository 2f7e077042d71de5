// Four floats at once, by the vector extension of GCC and clang: each lane is computed by plain IEEE operations, so results are
// the same bits on every machine, with vector units or without.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>

namespace fanstream {

using Float4 = float __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));

inline Float4 float4(const glm::vec3& v) { return Float4{v.x, v.y, v.z, 0.0F}; }
inline Float4 float4(float v) { return Float4{v, v, v, v}; }
inline glm::vec3 to_vec3(Float4 v) { return {v[0], v[1], v[2]}; }
inline Float4 rotate_axes(Float4 v) { return Float4{v[1], v[2], v[0], v[3]}; }  // y z x
inline float dot3(Float4 a, Float4 b) {
  const Float4 product = a * b;
  return product[0] + product[1] + product[2];
}
// The cross product with its axes rotated once: rotate_axes(cross_rotated(a, b)) is a x b. Sums of it are rotated at the end.
inline Float4 cross_rotated(Float4 a, Float4 b) { return a * rotate_axes(b) - rotate_axes(a) * b; }

}  // namespace fanstream
