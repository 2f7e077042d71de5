// A triangle of the full model, the faces that carry its pieces, and how a patch hands the pieces on (surface_error.h).
#pragma once

#include <algorithm>
#include <array>
#include <glm/vec2.hpp>

#include "common/mesh/triangle_mesh.h"
#include "server/build/star_distance.h"

namespace fanstream {

// How a triangle is cut into pieces. Each form is turned so that one corner is its first; k is that corner, i the next,
// j the one after.
enum class Cut : std::uint8_t {
  whole,   // one piece
  strip,   // that of k; that of i and j
  strips,  // that of k; one without a corner; that of i and j
  middle,  // that of i; that of k, which reaches across to the edge from i to j; that of j
  centre,  // those of k, i and j, which meet in a point
};

// One cache line.
struct alignas(64) CarriedTriangle {
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  VertexId corners[3];
  std::uint32_t faces[3];          // by piece: which face carries it
  glm::vec3 normal{0.0F};          // of length 1, or 0 where the triangle has no area
  std::uint32_t parent = kNone;    // the triangle that it is a part of
  std::uint32_t children = kNone;  // the first of the parts that stand for it, which are numbered on from there
  std::uint32_t stamp = kNone;     // the last patch that has listed it
  // Where the cuts are, in 65536ths. Strip and strips: along the edges from k to i and from k to j, then again for the
  // second cut. Middle: from k to i, from k to j, twice from i to j. Centre: from k to i, from i to j, from j to k,
  // then the shares of the way from k to i and from k to j at which the point inside lies.
  std::uint16_t shares[5] = {};
  Cut cut = Cut::whole;
  std::uint8_t first = 0;  // which corner is k
  std::uint8_t child_count = 0;

  int piece_count() const { return cut == Cut::whole ? 1 : cut == Cut::strip ? 2 : 3; }
  int piece_of_corner(int corner) const {
    if (cut == Cut::whole) return 0;
    const int turned = (corner + 3 - first) % 3;
    static constexpr int kPieces[4][3] = {{0, 1, 1}, {0, 2, 2}, {1, 0, 2}, {0, 1, 2}};
    return kPieces[static_cast<int>(cut) - 1][turned];
  }
};
static_assert(sizeof(CarriedTriangle) == 64);

// The corners of a piece, in order, such that it is made of the triangles {0, n, n + 1}.
struct Piece {
  std::array<glm::vec3, 5> points{};
  int count = 0;
};
Piece piece_of(const CarriedTriangle& triangle, const std::array<glm::vec3, 3>& corners, int piece);

// The triangle as a patch sees it. Faces are those of the star.
struct TriangleInStar {
  std::array<glm::vec3, 3> points{};       // its corners, seen from the star's centre
  std::array<bool, 3> inside{};            // by piece: whether the patch covers the face that carries it
  std::array<std::uint32_t, 3> nearest{};  // by corner, where its piece is inside: the nearest face
  std::array<float, 3> squared{};          // and the square of its distance
  // Likewise, where all corners are inside: the squares of the distances from all faces.
  std::array<const float*, 3> distances{};
  std::array<std::uint32_t, 3> faces{};  // out: by piece that is inside, which face carries it from now on
  std::uint32_t before =
      StarDistance::kNoFace;  // what has become of the face that has carried all of it, if it remains
  bool all_inside = false;
};

// Hands the triangles of one patch on, so that the largest distance at the corners of their pieces grows as little as
// it can. Not thread safe.
class TriangleCarrier {
 public:
  // `lower` is the square of a distance that some point has for sure: nothing is gained by coming below it. Nor is it
  // below `usual`, which others around have.
  void begin(const StarDistance& star, float lower, float usual) {
    star_ = &star;
    lower_ = upper_ = lower;
    usual_ = usual;
    good_ = std::max(upper_, usual_);
  }
  // A point was found to be that far off.
  void raise(float squared) {
    lower_ = std::max(lower_, squared);
    accept(squared);
  }
  // Takes a triangle's bound into the patch's.
  void accept(float squared) {
    upper_ = std::max(upper_, squared);
    good_ = std::max(good_, squared);
  }
  float lower() const { return lower_; }
  float upper() const { return upper_; }
  float usual() const { return usual_; }

  // Chooses the faces for the pieces that are inside, and other pieces if all are. Returns the square of their bound.
  // Precondition: a piece is inside.
  float carry(CarriedTriangle& triangle, TriangleInStar& at) const;

 private:
  struct Choice {
    float expected = std::numeric_limits<float>::infinity();  // the largest squared distance of a corner
    int first = 0;
    std::array<std::uint32_t, 3> faces{};
  };
  struct Choices {
    Choice strip, strips, middle;
  };

  float carry_all(CarriedTriangle& triangle, TriangleInStar& at) const;
  float carry_pieces(const CarriedTriangle& triangle, TriangleInStar& at) const;
  bool choose_beside(const TriangleInStar& at, Choice& strip) const;
  float strip_bound(const TriangleInStar& at, const Choice& choice, const CarriedTriangle& cut) const;
  Choices choose(const TriangleInStar& at) const;
  void cut_strip(CarriedTriangle& cut, const TriangleInStar& at, const Choice& choice) const;
  void cut_strips(CarriedTriangle& cut, const TriangleInStar& at, const Choice& choice) const;
  void cut_middle(CarriedTriangle& cut, const TriangleInStar& at, const Choice& choice) const;
  void cut_at_centre(CarriedTriangle& cut, const TriangleInStar& at) const;
  float share_between(const glm::vec3& from, const glm::vec3& to, std::uint32_t face_from, std::uint32_t face_to) const;
  float bound(const Piece& piece, std::uint32_t face) const;
  bool is_enough(float squared, float own) const;

  const StarDistance* star_ = nullptr;
  float lower_ = 0.0F;
  float upper_ = 0.0F;
  float usual_ = 0.0F;
  float good_ = 0.0F;  // what need not be improved
};

// The shares of the way from corner 0 to corners 1 and 2 at which the star's centre lies above the triangle.
glm::vec2 centre_above(const std::array<glm::vec3, 3>& corners);

}  // namespace fanstream
