// A cone of normals in about ten bits, never narrower than the one it stands for.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>

namespace fanstream {

// The axis is one of 16 x 16 points of an octahedron, unfolded; the half angle a multiple of 12 degrees.
struct CodedCone {
  static constexpr std::uint8_t kWidest = 7;  // 84 degrees
  static constexpr std::uint8_t kPlaces = 16;
  std::uint8_t width = 0;  // half angle in 12 degrees; 0: the normals look anywhere
  std::uint8_t u = 0;      // below kPlaces, and 0 where width is
  std::uint8_t v = 0;

  glm::vec3 axis() const;  // of length 1
  float cosine() const;    // of the half angle; -1 where width is 0
  // `direction` of any length; none holds. Where width is 0, that is all: rounded cosines can fall below -1.
  bool holds(const glm::dvec3& direction) const;
  friend bool operator==(const CodedCone&, const CodedCone&) = default;
};

// `axis` of length 1, `cosine` of the half angle; what is wider than 84 degrees after rounding looks anywhere.
CodedCone code_cone(const glm::vec3& axis, float cosine);

}  // namespace fanstream
