// From a mesh with its cover to a FanMesh with vertices, and back to triangles.
#pragma once

#include "common/fans/fan_cover.h"
#include "common/mesh/normals.h"

namespace fanstream {

// The triangles in drawing order: each fan's, (centre, ring i, ring i+1).
std::vector<Triangle> triangles_of(const FanMesh& mesh);

// The whole FanMesh of a triangle mesh: cover, points rounded to float, and normals by vertex_normals. Fails as
// cover_with_fans does.
Result<FanMesh> make_fan_mesh(const TriangleMesh& mesh, CoverMethod method = CoverMethod::best,
                              const NormalOptions& options = {});

// Each triangle a fan of its own, in their order, with normals likewise: for what is drawn too seldom for a cover to
// pay.
FanMesh make_triangle_fans(const TriangleMesh& mesh, const NormalOptions& options = {});

// Recomputes every normal from the points.
void set_normals(FanMesh& mesh, const NormalOptions& options = {});

}  // namespace fanstream
