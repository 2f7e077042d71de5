// Keeps merges from putting any place of the original surface much further off than others of their generation do.
//
// The quadrics know the mesh as a generation finds it, and squares summed over faces: a merge may be cheap by them and
// still leave one place far away, on top of what earlier generations have done there. A view that is promised "at most
// x px" then needs all of a cell's generation for that one place. Here the original's vertices and the middles of its
// edges are each kept with the face that is nearest to them (as in point_assignment.h, which does so for a cost), and a
// merge that would leave one of them further from the faces around than the limit waits for a later generation.
//
// The limit of a generation is `growth` times the kShare quantile of what the merges of the one before it have left.
// The first begins without one, as does one that follows a generation cut short by its limit: these get kTrialGrowth
// times the same quantile of their own first merges, the cheapest, as many as kTrialShare of the vertices. So what is
// much dearer waits, as the edges of a model do that is flat between them.
//
// Places are floats, in 4096ths of the model's diagonal; the distance is unsigned and to the faces around alone. It
// only decides what is merged when: what is *stated* of a model is measured by surface_error.h. Deterministic. Not
// thread safe.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "common/mesh/triangle_mesh.h"
#include "server/build/faces_around.h"
#include "server/build/star_distance.h"

namespace fanstream {

class DistanceLimit {
 public:
  static constexpr double kShare = 0.9;
  static constexpr double kTrialShare = 0.05;
  static constexpr float kTrialGrowth = 4.0F;

  // About 110 bytes a triangle. Faces are those of the mesh before any merge. Precondition: growth > 0.
  DistanceLimit(const TriangleMesh& mesh, double growth);

  // From now on merges are of the next generation, of a mesh of so many vertices. `limited`: its limit follows from the
  // last one's merges.
  void begin_generation(std::uint32_t vertices, bool limited);
  // Of the merges that are to come.
  bool is_limited() const { return limit_ < std::numeric_limits<float>::infinity(); }

  // Whether the merge leaves all points around it within the limit, with the parent at `target`.
  bool allows(VertexId root, VertexId removed, const glm::dvec3& target);
  // Makes the merge here too. Precondition: allows() was asked about it last, with any answer.
  void merge(VertexId root, VertexId removed);

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  struct Point {
    glm::vec3 place;
    std::uint32_t next;  // of the same face
  };
  struct Face {
    VertexId corners[3];
    std::uint32_t first_point = kNone;
  };
  struct Rest {  // a face that the merge leaves: its corners beside the parent
    std::uint32_t face;
    VertexId from, to;
  };

  glm::vec3 scaled(const glm::dvec3& p) const { return glm::vec3((p - middle_) * scale_); }
  void set_limit(float growth);
  bool has_edge(VertexId from, VertexId to) const;
  void add_point(const glm::dvec3& place, std::uint32_t face);
  void gather(VertexId root, VertexId removed);
  void gather_one(std::uint32_t face, VertexId centre, VertexId other, bool again);
  bool is_within(std::uint32_t face, std::uint32_t rest);

  float growth_;
  glm::dvec3 middle_{0.0};
  double scale_ = 1.0;
  std::vector<glm::vec3> places_;  // by vertex
  std::vector<Point> points_;
  std::vector<Face> faces_;
  FacesAround around_;
  static constexpr float kLeast = 1e-3F;                  // limit: what the rounding of places may add up to
  float limit_ = std::numeric_limits<float>::infinity();  // squared
  std::size_t trial_merges_ = 0;                          // that set the limit; 0: it is set
  std::vector<float> reached_;                            // by the merges of this generation, squared, in no order

  // Of the merge at hand.
  glm::vec3 target_{0.0F};
  std::vector<Rest> rest_;
  std::vector<std::uint32_t> vanishing_;
  StarDistance star_;  // of rest_, around target_
  std::vector<float> distances_;
  std::vector<std::uint32_t> moving_;
};

}  // namespace fanstream
