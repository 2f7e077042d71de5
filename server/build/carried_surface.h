// The full model as the current mesh carries it: which triangles, or parts of them, each face carries
// (surface_error.h).
#pragma once

#include "server/build/carried_triangle.h"
#include "server/build/patch_star.h"
#include "server/build/placed_mesh.h"

namespace fanstream {

// Follows the patches of a replay: gather() what a patch's covered faces carry, then each item is given its faces of
// the star, perhaps after it was cut, then rewrite_lists(). Not thread safe.
//
// A triangle that cannot be carried well in three pieces is cut into parts, triangles with corners of their own, which
// stand for it until they come together in one patch.
class CarriedSurface {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  struct alignas(32) Vertex {
    glm::vec3 place{0.0F};        // in the full model
    float squared = 0.0F;         // distance from the nearest face of the star at hand
    std::uint32_t face = 0;       // which that is
    std::uint32_t stamp = kNone;  // the patch for which this was found
    std::uint32_t distances = 0;  // free for who finds it
  };

  // Of one part of the model: nobody else's pieces are carried here.
  CarriedSurface(const PlacedMesh& mesh, std::uint32_t part);

  // Finds all triangles of which a face that a patch covers carries a piece. Returns whether there is one.
  bool gather(const GenerationStars& stars, std::size_t patch);
  // Asks for the memory that gathering a patch will need, soon.
  void fetch(const GenerationStars& stars, std::size_t patch) const;
  // The star that this patch leaves, which must stay where it is until rewrite_lists(). Call between those two.
  const PatchStar& star() const { return star_; }
  bool is_covered(std::uint32_t face) const { return lists_of_[face].covered_by == patch_; }
  const std::vector<std::uint32_t>& items() const { return items_; }
  bool has_parts() const { return has_parts_; }  // whether there are parts among the items, or were until just now

  CarriedTriangle& triangle(std::uint32_t t) { return triangles_[t]; }
  Vertex& vertex(VertexId v) { return vertices_[v]; }
  TriangleInStar in_star(const CarriedTriangle& triangle) const;  // without what vertices know

  // Cuts an item into parts; those that are inside become items, and are what it returns. Their vertices are new.
  std::span<const std::uint32_t> cut(std::uint32_t t);

  // Notes what the faces of the star carry now. The items are no longer valid.
  void rewrite_lists();

 private:
  struct List {  // of what a face carries, in lists_
    std::uint32_t begin = 0;
    std::uint32_t size = 0;
    std::uint32_t covered_by = kNone;  // the last patch of ours that has covered it
  };
  struct Part {
    VertexId corners[3];
    std::uint32_t face;
  };
  struct EdgePlane {
    glm::vec3 sides{0.0F};  // how far the corners are on the one side of it
    float share = 0.0F;     // of the triangle, by its extent across the plane, on the side that has less
  };

  bool is_inside(const CarriedTriangle& triangle) const;
  bool is_touched(const CarriedTriangle& triangle) const;
  void number_vertices(const PlacedMesh& mesh, std::uint32_t first);
  void gather_one(std::uint32_t t);
  void join_parts();
  bool are_parts_inside(const CarriedTriangle& whole) const;
  void join(CarriedTriangle& whole);
  void cut_whole(const CarriedTriangle& whole, const TriangleInStar& at);
  void cut_above_centre(const CarriedTriangle& whole, const TriangleInStar& at, const glm::vec2& above);
  EdgePlane best_plane(const TriangleInStar& at) const;
  void cut_along(const CarriedTriangle& whole, const TriangleInStar& at, const glm::vec3& sides);
  void quarter(const CarriedTriangle& whole, const TriangleInStar& at);
  void cut_pieces(const CarriedTriangle& whole, const TriangleInStar& at);
  void add_part(const CarriedTriangle& whole, VertexId a, VertexId b, VertexId c);
  VertexId vertex_at(const CarriedTriangle& whole, const TriangleInStar& at, const glm::vec3& point);
  VertexId add_vertex(const glm::vec3& seen_from_centre);
  std::uint32_t take_numbers(std::size_t count);
  void compact_lists();

  std::vector<CarriedTriangle> triangles_;
  std::vector<Vertex> vertices_;    // the full model's, then corners of parts
  std::size_t model_vertices_ = 0;  // those of the full model
  std::vector<List> lists_of_;      // by face of the current mesh
  std::vector<std::uint32_t> lists_;
  std::size_t listed_ = 0;                         // entries of lists_ in use
  std::vector<std::uint32_t> free_triangles_[10];  // first numbers of runs, by their length
  std::vector<VertexId> free_vertices_;

  // Of a patch.
  std::uint32_t patch_ = 0;
  PatchStar star_;
  std::vector<std::uint32_t> items_;
  std::vector<Part> parts_;
  std::vector<std::uint32_t> inside_;
  bool has_parts_ = false;
};

}  // namespace fanstream
