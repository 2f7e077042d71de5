// Points of the original surface, each kept with the face of the simplified mesh that is nearest to it (Hoppe et al.
// 1993).
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "server/build/merge_cost.h"

namespace fanstream {

// The original's vertices and `samples` more points, uniform by area (the same seed gives the same points on every
// machine; a surface without area has none). At first each is on a face of its own. A merge hands the points of the
// faces it changes to those that remain of them, each to the nearest: a point's distance is that from the faces around,
// an upper bound of its distance from the whole mesh. Not thread safe.
class PointAssignment {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  PointAssignment(const TriangleMesh& mesh, std::uint32_t samples, std::uint64_t seed);

  // The faces around both ends of an edge, and the points they hold.
  struct Surroundings {
    struct Rest {  // a face that a merge leaves: its corners beside the parent
      std::uint32_t face;
      VertexId from, to;
    };
    std::vector<Rest> rest;
    std::vector<std::uint32_t> points;
    double squares = 0.0;  // sum of the points' squared distances
  };
  void gather(VertexId root, VertexId removed, Surroundings& around) const;

  const glm::dvec3& point(std::uint32_t p) const { return points_[p].place; }
  std::size_t point_count() const { return points_.size(); }
  std::uint32_t face_of(std::uint32_t p) const { return points_[p].face; }
  const Triangle& corners(std::uint32_t face) const { return faces_[face].corners; }

  // The faces that a merge leaves, with the parent at `centre`: where the point nearest to x lies on them.
  class Star {
   public:
    void assign(const std::vector<Surroundings::Rest>& rest, const glm::dvec3& centre,
                const std::vector<glm::dvec3>& places);
    struct Nearest {
      double squared = 0.0;
      std::uint32_t index = 0;  // of the face, in `rest`
      glm::dvec3 place{0.0};
    };
    // Precondition: there is a face.
    Nearest nearest(const glm::dvec3& x) const;
    // The share of the centre in a point of a face; 0 where the face has no area.
    double share_of_centre(const Nearest& at) const;
    bool is_empty() const { return faces_.empty(); }

   private:
    struct Face {
      glm::dvec3 from, to, normal;  // as long as twice the area
      double normal2 = 0.0;
    };
    glm::dvec3 nearest_on(const Face& face, const glm::dvec3& x) const;

    glm::dvec3 centre_{0.0};
    std::vector<Face> faces_;
  };

  // Makes the merge; `places` are the vertices' afterwards.
  void merge(VertexId root, VertexId removed, const std::vector<glm::dvec3>& places);

 private:
  struct Point {
    glm::dvec3 place{0.0};
    double squared = 0.0;  // distance from its face
    std::uint32_t face = kNone;
    std::uint32_t next = kNone;  // of the same face
  };
  struct Face {
    Triangle corners;
    std::uint32_t first_point = kNone;
  };
  void add_point(const glm::dvec3& place, std::uint32_t face);
  void add_samples(const TriangleMesh& mesh, std::uint32_t samples, std::uint64_t seed);

  std::vector<Point> points_;
  std::vector<Face> faces_;
  std::vector<std::vector<std::uint32_t>> around_;  // by vertex: its faces
  Surroundings merging_;
  Star star_;
};

}  // namespace fanstream
