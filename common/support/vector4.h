// Four numbers at once, by the vector extension of GCC and clang: each lane is computed by plain IEEE or integer
// operations, so results are the same bits on every machine whose vector units round as IEEE 754 says (SSE2, AArch64,
// WebAssembly).
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <glm/vec3.hpp>

namespace fanstream {

using Float4 = float __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));
using Uint4 = std::uint32_t __attribute__((vector_size(16)));

inline Float4 float4(const glm::vec3& v) { return Float4{v.x, v.y, v.z, 0.0F}; }
inline Float4 float4(float v) { return Float4{v, v, v, v}; }
inline Int4 int4(std::int32_t v) { return Int4{v, v, v, v}; }
inline Int4 int4(const glm::ivec3& v) { return Int4{v.x, v.y, v.z, 0}; }
inline glm::ivec3 to_ivec3(Int4 v) { return {v[0], v[1], v[2]}; }
inline Uint4 uint4(std::uint32_t v) { return Uint4{v, v, v, v}; }
inline glm::vec3 to_vec3(Float4 v) { return {v[0], v[1], v[2]}; }
inline Float4 to_float4(Int4 v) { return __builtin_convertvector(v, Float4); }

// Loads and stores anywhere.
inline Uint4 load4(const std::uint32_t* from) {
  Uint4 lanes;
  std::memcpy(&lanes, from, sizeof(lanes));
  return lanes;
}
inline Float4 load4(const float* from) {
  Float4 lanes;
  std::memcpy(&lanes, from, sizeof(lanes));
  return lanes;
}
inline void store4(std::uint32_t* to, Uint4 lanes) { std::memcpy(to, &lanes, sizeof(lanes)); }
inline void store4(float* to, Float4 lanes) { std::memcpy(to, &lanes, sizeof(lanes)); }

// Comparisons give masks: all ones where true. They have the lanes' size, whatever type the compiler gives them.
inline Uint4 mask_of(auto comparison) { return std::bit_cast<Uint4>(comparison); }
inline Uint4 chosen(Uint4 mask, Uint4 yes, Uint4 no) { return (mask & yes) | (~mask & no); }
inline Float4 chosen(Uint4 mask, Float4 yes, Float4 no) {
  return std::bit_cast<Float4>(chosen(mask, std::bit_cast<Uint4>(yes), std::bit_cast<Uint4>(no)));
}
// For lanes below 2^31, which every machine compares at once.
inline Uint4 less(Uint4 a, Uint4 b) { return mask_of(std::bit_cast<Int4>(a) < std::bit_cast<Int4>(b)); }
inline constexpr Uint4 kLaneNumbers = {0, 1, 2, 3};
inline std::uint32_t any_bits(Uint4 v) {
  const Uint4 pairs = v | __builtin_shufflevector(v, v, 2, 3, 0, 1);
  return pairs[0] | pairs[1];
}
inline bool any_negative(Int4 v) { return static_cast<std::int32_t>(any_bits(std::bit_cast<Uint4>(v))) < 0; }

inline Float4 rotate_axes(Float4 v) { return __builtin_shufflevector(v, v, 1, 2, 0, 3); }  // y z x
inline float dot3(Float4 a, Float4 b) {
  const Float4 product = a * b;
  return product[0] + product[1] + product[2];
}
// The cross product with its axes rotated once: rotate_axes(cross_rotated(a, b)) is a x b. Sums of it are rotated at
// the end.
inline Float4 cross_rotated(Float4 a, Float4 b) { return a * rotate_axes(b) - rotate_axes(a) * b; }

// The sums of the first three lanes of four vectors, each added up as dot3 does it.
inline Float4 sums3(Float4 a, Float4 b, Float4 c, Float4 d) {
  const Float4 xy_ab = __builtin_shufflevector(a, b, 0, 4, 1, 5);
  const Float4 xy_cd = __builtin_shufflevector(c, d, 0, 4, 1, 5);
  const Float4 zw_ab = __builtin_shufflevector(a, b, 2, 6, 3, 7);
  const Float4 zw_cd = __builtin_shufflevector(c, d, 2, 6, 3, 7);
  const Float4 x = __builtin_shufflevector(xy_ab, xy_cd, 0, 1, 4, 5);
  const Float4 y = __builtin_shufflevector(xy_ab, xy_cd, 2, 3, 6, 7);
  const Float4 z = __builtin_shufflevector(zw_ab, zw_cd, 0, 1, 4, 5);
  return x + y + z;
}

}  // namespace fanstream
