// Past the finest level: where the live mesh is the full model, its faces are subdivided for the view, so that a
// close-up of a coarse model has no polygonal outline. SMOOTHING.md beside this header says what that does to a model.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "client/subdivide/view_subdivision.h"
#include "common/refine/source_polygons.h"

namespace fanstream {

struct SmoothOptions {
  unsigned front_depth = 4;       // half-steps of faces turned to the eye, at most kMaxViewDepth
  unsigned silhouette_depth = 8;  // of those at the silhouette, likewise
  double size_px = 1.0;           // edges so short on the screen are not cut further
  double tolerance_px = 0.25;     // faces so near to what they would become are not either
  // Edges that bend by more, and boundaries that turn by more, stay as they are, with all faces that touch them.
  // 180: everything is smoothed.
  double crease_angle_deg = 75.0;
  std::uint64_t max_triangles = 1'000'000;  // of the result, at least; where it would be more, depths are lowered
  std::function<bool()> stop = {};          // asked between half-steps; true ends it with `interrupted`
};

struct SmoothReport {
  std::uint64_t faces_before = 0;    // of the live mesh, polygons joined
  std::uint64_t finest_faces = 0;    // of these, faces of the full model
  std::uint64_t eligible_faces = 0;  // of these, what may be subdivided
  std::uint64_t faces_after = 0;     // the same as before where nothing was done
  std::uint64_t triangles_after = 0;
  unsigned depth = 0;                              // the deepest that was reached, in half-steps
  unsigned front_depth = 0, silhouette_depth = 0;  // in force: max_triangles may have lowered them
  std::string limitation;                          // why less was done than asked for; empty if all was
  double seconds = 0.0;                            // all of it, by the clock
};

struct SmoothedMesh {
  TriangleMesh mesh;  // watertight where the live mesh is: no T-vertices; its vertices come first, in their order
  SmoothReport report;
};

// Which faces may be subdivided: those that are finest, have only finest faces around their corners, touch no crease
// and no vertex that shares its place with another, and have no neighbour along more than one edge. So nothing moves
// that a face which is not finest can see. `faces`: of the live mesh.
std::vector<std::uint8_t> eligible_faces(const LiveFaces& faces, double crease_angle_deg);

// Where the mesh is coarser, the result is the live mesh, bit for bit. Deterministic. Fails as check_view, (usage) for
// depths beyond the limit, and (interrupted). Precondition: `faces` are live_faces() of some mesh.
Result<SmoothedMesh> smooth_for_view(const LiveFaces& faces, const View& view, const SmoothOptions& options = {});

// The asset's polygons along with a mesh that is being received, decoded as it grows, and the smoothing of that mesh.
// Not thread safe.
class SilhouetteSmoother {
 public:
  explicit SilhouetteSmoother(SmoothOptions options) : options_(std::move(options)) {}

  // The live mesh, smoothed where it may be. Before the asset's polygons have come (ProgressiveMesh::polygon_bytes)
  // nothing is, since the faces are not known; a section or block that is damaged counts as unknown, and the report
  // says so. Errors as smooth_for_view. Always of one and the same mesh.
  Result<SmoothedMesh> smooth(const ProgressiveMesh& mesh, const View& view);

 private:
  void update_polygons(const ProgressiveMesh& mesh);

  SmoothOptions options_;
  std::optional<SourcePolygons> polygons_;
  bool unreadable_ = false;
  std::string damage_;
};

}  // namespace fanstream
