// A triangle of the full model, the faces that carry its pieces, and how a patch hands the pieces on (surface_error.h).
#pragma once

#include <algorithm>
#include <array>

#include "common/mesh/triangle_mesh.h"
#include "server/build/star_distance.h"

namespace fanstream {

// Edge e leads from corner e to corner e + 1. One cache line.
struct alignas(64) CarriedTriangle {
  static constexpr std::uint8_t kCentre = 3;
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  VertexId corners[3];
  std::uint32_t faces[3];  // by corner: which face carries its piece
  glm::vec3 normal{0.0F};  // of length 1, or 0 where the triangle has no area
  // kCentre: the point inside is corner 0 and these shares of the way to corners 1 and 2. A strip: the point inside
  // lies between the crossings of the odd corner's two edges, centre[0] of the way from the one that leaves the corner
  // to the one that leads to it.
  float centre[2] = {1.0F / 3.0F, 1.0F / 3.0F};
  std::uint32_t parent = kNone;    // the triangle that it is a part of
  std::uint32_t children = kNone;  // the first of those that stand for it, which are numbered on from there
  std::uint32_t stamp = kNone;     // the last patch that has listed it
  std::uint16_t crossings[3] = {0x8000, 0x8000, 0x8000};  // by edge: where along it two pieces meet, in 65536ths
  std::uint8_t form = kCentre;                            // otherwise a strip: the odd corner, which is cut off
  std::uint8_t child_count = 0;

  bool is_whole() const { return faces[0] == faces[1] && faces[1] == faces[2]; }
  float crossing_share(int edge) const { return static_cast<float>(crossings[edge]) * 0x1p-16F; }
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

// Hands the triangles of one patch on, so that the largest distance at the corners of their pieces grows as little as
// it can. Not thread safe.
class TriangleCarrier {
 public:
  // `lower` is the square of a distance that some point has for sure: nothing is gained by coming below it.
  void begin(const StarDistance& star, float lower) {
    star_ = &star;
    lower_ = upper_ = lower;
  }
  // A point was found to be that far off.
  void raise(float squared) {
    lower_ = std::max(lower_, squared);
    upper_ = std::max(upper_, squared);
  }
  // Takes a triangle's bound into the patch's.
  void accept(float squared) { upper_ = std::max(upper_, squared); }
  float lower() const { return lower_; }
  float upper() const { return upper_; }

  // Chooses the faces for the corners that are inside, and new crossings where that is allowed. Returns the squared
  // bound for the pieces inside. Precondition: a corner is inside.
  float carry(CarriedTriangle& triangle, TriangleInStar& at) const;

 private:
  float carry_all(CarriedTriangle& triangle, TriangleInStar& at) const;
  float carry_two(CarriedTriangle& triangle, TriangleInStar& at, int outside) const;
  float carry_one(const CarriedTriangle& triangle, TriangleInStar& at, int corner) const;
  float cut_off(CarriedTriangle& triangle, const TriangleInStar& at, int odd, float own) const;
  float cut_in_three(CarriedTriangle& triangle, const TriangleInStar& at, float own) const;
  float part_two(CarriedTriangle& triangle, const TriangleInStar& at, int outside, float own) const;
  float improve_crossing(const glm::vec3& from, const glm::vec3& to, std::uint32_t face_from, std::uint32_t face_to,
                         float& share, float value) const;
  bool is_enough(float squared, float own) const;

  const StarDistance* star_ = nullptr;
  float lower_ = 0.0F;
  float upper_ = 0.0F;
};

// The points that a triangle's pieces meet in, seen from the star's centre.
glm::vec3 crossing_of(const CarriedTriangle& triangle, const TriangleInStar& at, int edge);
glm::vec3 centre_of(const CarriedTriangle& triangle, const TriangleInStar& at);

}  // namespace fanstream
