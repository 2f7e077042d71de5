// Homogeneous points as two pairs of doubles, each in one register of every machine with 128-bit vectors.
#pragma once

#include <cstring>
#include <glm/vec4.hpp>

namespace fanstream {

struct Point4 {
  using Pair = double __attribute__((vector_size(16)));
  Pair xy{0.0, 0.0};
  Pair zw{0.0, 0.0};

  friend Point4 operator+(const Point4& a, const Point4& b) { return {a.xy + b.xy, a.zw + b.zw}; }
  friend Point4 operator-(const Point4& a, const Point4& b) { return {a.xy - b.xy, a.zw - b.zw}; }
  friend Point4 operator*(const Point4& a, double s) { return {a.xy * s, a.zw * s}; }
};

inline Point4 load(const glm::dvec4& from) {
  Point4 point;
  std::memcpy(&point.xy, &from.x, sizeof point.xy);
  std::memcpy(&point.zw, &from.z, sizeof point.zw);
  return point;
}
inline void store(glm::dvec4& to, const Point4& point) {
  std::memcpy(&to.x, &point.xy, sizeof point.xy);
  std::memcpy(&to.z, &point.zw, sizeof point.zw);
}
inline void add_to(glm::dvec4& to, const Point4& point) { store(to, load(to) + point); }

}  // namespace fanstream
