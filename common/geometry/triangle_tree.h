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
// outwards. Holds copies of the corners, so the mesh may go away: about 110 bytes a triangle.
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
  // not depend on it. `query` must be finite and below 1e70 in magnitude.
  SurfacePoint closest(const glm::dvec3& query, std::uint32_t hint = 0) const;

  std::size_t triangle_count() const { return corners_.size(); }
  // The index in the mesh of the triangle in a slot.
  std::uint32_t triangle(std::uint32_t slot) const { return triangles_[slot]; }

 private:
  static constexpr int kChildren = 4;

  // One lane per child: compilers do not vectorise the box distances from plain arrays. GCC and clang, any target.
  using FourFloats = float __attribute__((vector_size(16)));

  struct alignas(64) Node {
    // Boxes in units of the root box's largest extent, seen from its centre.
    FourFloats low[3];
    FourFloats high[3];
    // A leaf's first slot, or a node's index; empty children have a box that nothing reaches.
    std::uint32_t child[kChildren];
    std::uint32_t triangle_count[kChildren];  // 0 for a node
  };
  struct Corners {
    glm::dvec3 a, b, c;
  };
  class Builder;

  void offer(const glm::dvec3& query, std::uint32_t slot, SurfacePoint& best) const;

  std::vector<Node> nodes_;  // the root first
  std::vector<Corners> corners_;
  std::vector<std::uint32_t> triangles_;
  glm::dvec3 centre_{0.0};
  double scale_ = 1.0;  // from the model's units to the boxes'
};

}  // namespace fanstream
