// Where a mesh meets another: pairs of triangles that intersect or touch, and the distance of meshes that do not.
//
// Surfaces meet surfaces: an obstacle that lies inside a closed model without reaching its surface does not touch it.
// Pairs are found by FCL (Pan, Chitta, Manocha: "FCL: A general purpose library for collision and proximity queries",
// 2012) with trees of OBBRSS volumes: of the model only over those triangles of which the boxes that hold them reach a
// volume of the obstacle's tree.
#pragma once

#include <memory>

#include "client/collision/live_surface.h"
#include "client/collision/plane_contacts.h"
#include "common/support/result.h"

namespace fanstream {

// A mesh to collide with. Immutable; const use is thread safe.
class MeshObstacle {
 public:
  // O(n log n). Fails (bad_input) for a mesh without triangles, a triangle that names a vertex which does not exist,
  // and a coordinate that is not finite or beyond 1e70; (limit) for 2^31 triangles or more.
  static Result<MeshObstacle> create(const TriangleMesh& mesh);
  std::size_t triangle_count() const;
  Bounds box() const;

 private:
  friend class MeshSearch;
  friend std::function<bool(const Bounds&)> region_of(const MeshObstacle& obstacle);
  struct Data;
  explicit MeshObstacle(std::shared_ptr<const Data> data) : data_(std::move(data)) {}
  std::shared_ptr<const Data> data_;
};

struct MeshContact {
  std::array<glm::dvec3, 3> corners{};  // of the model's triangle, counter-clockwise, the least one (x, y, z) first
  std::uint32_t obstacle_triangle = 0;  // its index in the obstacle's mesh
  bool original = false;                // whether the model's triangle is one of the full model
  // Where the two intersect, and how they could be separated: FCL's, of this pair alone.
  glm::dvec3 position{0.0};
  glm::dvec3 normal{0.0};
  double depth = 0.0;
};

struct MeshContacts {
  std::vector<MeshContact> contacts;   // no more than asked for
  std::uint64_t touching_pairs = 0;    // listed or not, but no more than kMostPairs
  std::uint64_t original_pairs = 0;    // of those, with triangles of the full model
  bool all_found = true;               // false: there are more than kMostPairs
  std::uint64_t tested_triangles = 0;  // of the model, that could not be excluded by cells
};

inline constexpr std::uint64_t kMostPairs = 1'000'000;

// A triangle is looked at in the same way in every mesh that has it.
MeshContacts find_contacts(const LiveSurface& surface, const MeshObstacle& obstacle,
                           std::uint64_t most_listed = kMostPairs);
MeshContacts find_contacts(const SurfacePatch& patch, const MeshObstacle& obstacle,
                           std::uint64_t most_listed = kMostPairs);

// The least distance of the surfaces, and the points that have it; 0 where they touch.
struct Separation {
  double distance = 0.0;
  glm::dvec3 on_model{0.0}, on_obstacle{0.0};
};
// Looks at the whole mesh. Precondition: it has triangles.
Separation distance_between(const LiveSurface& surface, const MeshObstacle& obstacle);

// For a Focus: where the obstacle may be, so that the triangles that touch it are those of the full model.
std::function<bool(const Bounds&)> region_of(const MeshObstacle& obstacle);

}  // namespace fanstream
