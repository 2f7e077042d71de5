#include "client/collision/surface_patch.h"

namespace fanstream {

SurfacePatch patch_of(const TriangleMesh& mesh) {
  SurfacePatch patch;
  for (const glm::dvec3& p : mesh.positions) {
    patch.x.push_back(p.x);
    patch.y.push_back(p.y);
    patch.z.push_back(p.z);
  }
  patch.triangles = mesh.triangles;
  return patch;
}

}  // namespace fanstream
