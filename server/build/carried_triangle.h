// A triangle of the full model, the faces that carry its pieces, and how a patch hands the pieces on (surface_error.h).
#pragma once

#include <array>
#include <cmath>

#include "common/mesh/triangle_mesh.h"
#include "server/build/star_distance.h"

namespace fanstream {

// Edge e leads from corner e to corner e + 1.
struct alignas(64) CarriedTriangle {
  static constexpr std::uint32_t kCentre = 3;

  VertexId corners[3];
  std::uint32_t faces[3];                   // by corner: which face carries its piece
  glm::vec3 normal{0.0F};                   // of length 1, or 0 where the triangle has no area
  float crossings[3] = {0.5F, 0.5F, 0.5F};  // by edge: where along it two pieces meet
  // kCentre: the point inside is corner 0 and these shares of the way to corners 1 and 2. Otherwise a strip: the number
  // of the corner that is cut off; the point inside lies between the crossings of its two edges, centre[0] of the way
  // from the one that leaves it to the one that leads to it.
  std::uint32_t form = kCentre;
  float centre[2] = {1.0F / 3.0F, 1.0F / 3.0F};
  std::uint32_t stamp = 0xFFFFFFFFU;  // the last patch that has listed it

  bool is_whole() const { return faces[0] == faces[1] && faces[1] == faces[2]; }
};
static_assert(sizeof(CarriedTriangle) == 64);

// The triangle as a patch sees it. Faces are those of the star.
struct TriangleInStar {
  static constexpr std::uint32_t kNoFace = 0xFFFFFFFFU;
  std::array<glm::vec3, 3> points{};     // its corners, seen from the star's centre
  std::array<bool, 3> inside{};          // whether the patch covers the face that carries the corner
  std::array<std::uint32_t, 3> faces{};  // in: nearest to the corner; out: which carries its piece from now on
  std::array<float, 3> squared{};        // distance of the corner from the nearest face
  std::uint32_t before = kNoFace;        // what has become of the one face that has carried the triangle, if it remains

  bool all_inside() const { return inside[0] && inside[1] && inside[2]; }
  bool all_on_one() const { return faces[0] == faces[1] && faces[1] == faces[2]; }
};

// Hands the triangles of one patch on, and keeps the largest distance at the corners of their pieces. Prefers what does
// not raise it: only the largest counts. Not thread safe.
class TriangleCarrier {
 public:
  // `squared` is the largest distance that is known already.
  void begin(const StarDistance& star, float squared) {
    star_ = &star;
    squared_ = squared;
  }
  float error() const { return std::sqrt(squared_); }

  // Precondition: a corner is inside.
  void carry(CarriedTriangle& triangle, TriangleInStar& at);

 private:
  void carry_all(CarriedTriangle& triangle, TriangleInStar& at);
  void carry_two(CarriedTriangle& triangle, TriangleInStar& at, int outside);
  void carry_one(const CarriedTriangle& triangle, TriangleInStar& at, int corner);
  float cut_off(CarriedTriangle& triangle, const TriangleInStar& at, int odd, float own);
  float cut_in_three(CarriedTriangle& triangle, const TriangleInStar& at, float own);
  float part_two(CarriedTriangle& triangle, const TriangleInStar& at, int outside, float own);
  float improve_crossing(const glm::vec3& from, const glm::vec3& to, std::uint32_t face_from, std::uint32_t face_to,
                         float& share, float value) const;
  bool is_enough(float squared, float own) const;

  const StarDistance* star_ = nullptr;
  float squared_ = 0.0F;
};

}  // namespace fanstream
