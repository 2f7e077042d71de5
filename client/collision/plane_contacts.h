// Where a mesh meets a plane: the signed distance of its triangles, each looked at only if the boxes above it leave the
// question open.
//
// A plane is the surface of a solid that fills its negative side. A triangle *touches* it where corners on or behind it
// and corners on or before it are its own (min <= 0 <= max of the three distances), is *behind* it where all three are
// (max < 0), else before it. Distances are computed as (a x + b y) + c z + d in doubles with a unit normal, one way
// wherever they are computed: the same triangle has the same distances, to the last bit, in every mesh.
//
// Source: Odauchi, Tsukiji: collision of polygons with planes by signed distance, on the locally restored mesh.
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "client/collision/focus.h"
#include "client/collision/live_surface.h"
#include "client/collision/surface_patch.h"
#include "common/support/result.h"

namespace fanstream {

struct Plane {
  glm::dvec3 normal{0.0, 0.0, 1.0};  // of length 1, out of the solid
  double offset = 0.0;
  double distance(const glm::dvec3& p) const { return normal.x * p.x + normal.y * p.y + normal.z * p.z + offset; }
};
// a x + b y + c z + d = 0, of any length. Fails (usage) where a number is not finite or the normal is zero.
Result<Plane> make_plane(double a, double b, double c, double d);

struct PlaneContact {
  std::array<glm::dvec3, 3> corners{};  // counter-clockwise seen from outside
  std::array<double, 3> distances{};    // of the corners, negative in the solid
  bool original = false;                // a triangle of the full model
  double depth() const;                 // how far the deepest corner is in the solid, at least 0
};

struct PlaneContacts {
  std::vector<PlaneContact> contacts;  // of triangles that touch, no more than the limit
  std::uint64_t touching = 0;          // triangles, listed or not
  std::uint64_t behind = 0;            // triangles
  // Of the vertex that lies deepest in the solid, whether or not its triangles touch the plane; positive: the least
  // distance that vertices have. Infinite for a mesh without triangles.
  double least_distance = std::numeric_limits<double>::infinity();
  glm::dvec3 least_at{0.0};
  std::uint64_t tested_triangles = 0;  // how many were looked at

  std::uint64_t touching_original = 0;  // of those that touch, triangles of the full model
  bool collides() const { return touching + behind > 0; }
  void clear();  // keeps memory

  struct Scratch {  // of searches, to be used again
    struct Left {
      float least = 0.0F;
      std::uint32_t below = 0;  // LiveSurface::Node's
    };
    std::vector<double> distances;    // by vertex of the patch at hand
    std::vector<std::uint8_t> sides;  // likewise
    std::vector<std::uint32_t> open, blocks, triangles;
    std::vector<Left> left;  // parts that may hold the least distance
  };
  Scratch scratch;
};

struct PlaneQuery {
  std::uint64_t most_listed = std::numeric_limits<std::uint64_t>::max();
  bool least_distance = true;  // false: PlaneContacts::least_distance and least_at stay as they are
  // Only triangles in this focus count (FocusTest::holds): where it covers the surface, all that is found is what the
  // full model has there, and takes no time for the rest of the mesh. Of a surface only. None: all triangles count.
  const FocusTest* within = nullptr;
};

// Adds what is found to `found`, of which the least distance so far counts too. Takes time for the triangles in cells
// whose boxes the plane cuts and for the boxes above them; and for the vertex of the least distance.
void find_contacts(const LiveSurface& surface, const Plane& plane, PlaneContacts& found, const PlaneQuery& query = {});
// All triangles of a patch, one after another.
void find_contacts(const SurfacePatch& patch, const Plane& plane, PlaneContacts& found, const PlaneQuery& query = {});

// For a Focus: what the planes cut, so that the triangles that touch them are those of the full model.
std::function<bool(const Bounds&)> region_of(std::vector<Plane> planes);

}  // namespace fanstream
