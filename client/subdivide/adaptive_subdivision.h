// sqrt(2)-subdivision of chosen faces only, half-step by half-step, without T-vertices.
//
// Each step chooses among the faces of the present depth; what is not chosen is finished and never refined again, as in
// the source, where every view starts from the initial mesh. An edge between a refined and an unrefined face stays.
//
// What is refined is exact: every vertex of the result lies where uniform refinement has it at the depth that the
// vertex has reached. For that, a face can be refined only if all faces around its vertices are of its depth. So the
// refined region loses a ring of faces with each full step, and the mesh coarsens gradually around it; with_support()
// widens a choice such that nothing of it is lost.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "client/subdivide/subdivision.h"

namespace fanstream {

inline constexpr unsigned kMaxAdaptiveDepth = 250;

struct AdaptiveMesh {
  PolygonMesh mesh;  // the first points are those of the initial mesh, moved where a face around them was refined
  std::vector<std::uint8_t>
      face_depths;                   // half-steps; triangles between a refined and an unrefined face count the step
  std::vector<FaceId> face_origins;  // a face of the initial mesh that the face lies in
};

// One instance is for one thread at a time. Nothing is shared between instances.
class AdaptiveSubdivision {
 public:
  // Fails as check_polygons.
  static Result<AdaptiveSubdivision> create(const PolygonMesh& mesh, const SubdivisionOptions& options = {});

  unsigned depth() const { return depth_; }  // half-steps done
  bool next_is_odd() const { return depth_ % 2 == 0; }

  std::span<const glm::dvec4> points() const { return points_; }

  // The faces of the present depth, numbered anew after each refine(). After an odd step they are quads (two ends of an
  // edge, two face points) and triangles (a boundary edge, a face point), after an even one quads.
  std::size_t active_count() const { return begins_.size() - 1; }
  std::span<const VertexId> active_face(FaceId f) const {
    return std::span<const VertexId>(corners_).subspan(begins_[f], begins_[f + 1] - begins_[f]);
  }
  FaceId active_origin(FaceId f) const { return origins_[f]; }
  // The active face across the edge from corner k to the next one, or kNoFace at the boundary or a finished face.
  FaceId active_neighbor(FaceId f, std::size_t k) const;
  bool at_boundary(FaceId f, std::size_t k) const;  // whether the surface ends at that edge
  // Whether all faces around the vertices of f are active; always so at depth 0.
  bool refinable(FaceId f) const { return refinable_[f] != 0; }

  // Where the next step will have the points if it refines everything: after an odd step as vertices, as they are where
  // a face around them is finished. Even steps move nothing.
  std::vector<glm::dvec4> next_points() const;
  // Before an even step: the point that will be put into the active face.
  const glm::dvec4& edge_point(FaceId f) const { return edge_points_[f]; }

  // Marks (1) what must be refined besides the faces marked in `chosen` (one value per active face), so that children
  // of chosen faces can be refined on and on: by `further_steps` full steps after the one under way. One needs a ring
  // of faces, two and all more need two: a region loses a ring of faces at each full step, and these get half as wide.
  void add_support(std::vector<std::uint8_t>& chosen, unsigned further_steps = 2) const;

  // One half-step of all active faces that are marked (not 0) and refinable; every other active face is finished.
  // Vertices of refined faces move, also where they belong to finished ones. With nothing to refine, only the depth
  // rises. Fails (limit) where the mesh would exceed max_corners, before taking memory, changing nothing.
  Result<void> refine(std::span<const std::uint8_t> chosen);

  // The mesh as it is: finished faces, then active ones.
  AdaptiveMesh result() const&;
  AdaptiveMesh result() &&;
  std::size_t face_count() const { return finished_begins_.size() - 1 + active_count(); }

 private:
  class Step;
  AdaptiveSubdivision() = default;
  AdaptiveMesh take_result();
  void add_ring(std::vector<std::uint8_t>& chosen) const;
  void add_second_neighbors(std::vector<std::uint8_t>& chosen) const;
  glm::dvec4 centroid(FaceId f) const;
  // The vertices of the marked active faces after the odd step. They must be complete: all faces around them active.
  struct Move {
    VertexId vertex;
    glm::dvec4 target;
  };
  std::vector<Move> moves(const std::vector<std::uint8_t>& marked) const;

  SubdivisionOptions options_;
  unsigned depth_ = 0;
  std::vector<glm::dvec4> points_;
  // Active faces; a corner is also the half-edge from it to the face's next corner.
  std::vector<std::uint32_t> begins_ = {0U};
  std::vector<VertexId> corners_;
  std::vector<std::uint32_t> twins_;  // the opposite half-edge, or one of two marks
  std::vector<FaceId> corner_faces_;
  std::vector<FaceId> origins_;
  std::vector<std::uint8_t> refinable_;
  std::vector<glm::dvec4> edge_points_;  // at odd depths, of each active face
  std::vector<VertexId> finished_corners_;
  std::vector<std::uint32_t> finished_begins_ = {0U};
  std::vector<std::uint8_t> finished_depths_;
  std::vector<FaceId> finished_origins_;
};

}  // namespace fanstream
