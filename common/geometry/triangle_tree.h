// A bounding volume hierarchy over the triangles of a mesh that answers "which point of the surface is closest?".
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <vector>

#include "common/mesh/triangle_mesh.h"
#include "common/support/result.h"

namespace fanstream {

// A point of the surface, as TriangleTree::closest finds it.
struct SurfacePoint {
  glm::dvec3 position{0.0};
  double squared_distance = std::numeric_limits<double>::infinity();  // from the query
  // Where the triangle lies in the tree; give it to the next query nearby. Meaningless for any other tree.
  std::uint32_t slot = 0;
};

// Answers are exact up to the rounding of doubles: boxes only decide what need not be looked at, and they are rounded
// outwards. Holds copies of the corners, so the mesh may go away: about 130 bytes a triangle.
// Const members may be called from several threads at once.
//
// Nodes have four children, whose boxes are tested together; built top-down with a binned surface area heuristic
// (Wald, "On fast construction of SAH-based bounding volume hierarchies", 2007).
class TriangleTree {
 public:
  // O(n log n). Fails with bad_input for a mesh without triangles, for a triangle that names a vertex which does not
  // exist, and for a coordinate that is not finite or beyond 1e70; with limit for 2^31 triangles or more.
  static Result<TriangleTree> build(const TriangleMesh& mesh);

  // The closest point of the surface. Degenerate triangles count as the segment or point that they are.
  // `hint` is the slot of an earlier answer: the nearer the earlier query, the faster this one; the distance found does
  // not depend on it but for rounding. `query` must be finite and below 1e70 in magnitude.
  SurfacePoint closest(const glm::dvec3& query, std::uint32_t hint = 0) const;

  std::size_t triangle_count() const { return triangle_count_; }
  // The index in the mesh of the triangle in a slot.
  std::uint32_t triangle(std::uint32_t slot) const { return triangles_[slot]; }
  // All triangles of the mesh, each once, in the order of the leaves: neighbours on the list are close in space.
  std::vector<std::uint32_t> triangles_in_order() const;

 private:
  static constexpr int kChildren = 4;

  // Vectors of GCC and clang, on any target: neither vectorises these loops over plain arrays.
  using FourFloats = float __attribute__((vector_size(16)));
  using TwoDoubles = double __attribute__((vector_size(16)));

  struct alignas(64) Node {
    // Boxes in units of the root box's largest extent, seen from its centre.
    FourFloats low[3];
    FourFloats high[3];
    // A leaf's first pair, or a node's index; empty children have a box that nothing reaches.
    std::uint32_t child[kChildren];
    std::uint32_t pair_count[kChildren];  // of a leaf; 0 for a node
  };
  // Two triangles side by side, one a lane; a leaf of odd size repeats its last one.
  struct Pair {
    TwoDoubles a[3];
    TwoDoubles b[3];
    TwoDoubles c[3];
    glm::dvec3 corner_a(int lane) const { return {a[0][lane], a[1][lane], a[2][lane]}; }
    glm::dvec3 corner_b(int lane) const { return {b[0][lane], b[1][lane], b[2][lane]}; }
    glm::dvec3 corner_c(int lane) const { return {c[0][lane], c[1][lane], c[2][lane]}; }
  };
  struct Nearest {
    double squared_distance = std::numeric_limits<double>::infinity();
    std::uint32_t slot = 0;
  };
  class Builder;

  static TwoDoubles squared_distances(const TwoDoubles (&query)[3], const Pair& pair);
  void offer(const TwoDoubles (&query)[3], std::uint32_t pair, Nearest& best) const;

  std::vector<Node> nodes_;  // the root first
  std::vector<Pair> pairs_;
  std::vector<std::uint32_t> triangles_;  // two a pair
  std::size_t triangle_count_ = 0;
  glm::dvec3 centre_{0.0};
  double scale_ = 1.0;  // from the model's units to the boxes'
};

}  // namespace fanstream
