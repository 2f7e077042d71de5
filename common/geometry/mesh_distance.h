// How far apart two surfaces are, measured from both sides.
//
// After Cignoni, Rocchini, Scopigno, "Metro: measuring error on simplified surfaces", 1998: one surface is sampled, and
// for every sample the exact closest point of the other surface is found. The symmetric figures are the larger of the
// two directions, as in Metro and in Aspert, Santa-Cruz, Ebrahimi, "MESH: measuring errors between surfaces using the
// Hausdorff distance", 2002.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>

#include "common/geometry/triangle_tree.h"
#include "common/mesh/triangle_mesh.h"
#include "common/support/result.h"

namespace fanstream {

struct DistanceOptions {
  // Random points on the sampled surface, uniform by area and stratified (one in each n-th part of the area), in
  // addition to all its vertices. From seed to seed the rms of 200,000 varies by about 0.3 % and the maximum by about
  // 10 %; where a few folded faces carry most of the error (seen on a CAD part) the rms varies by up to 20 %
  // (4 % with a million).
  std::size_t face_samples = 200'000;
  std::uint64_t seed = 1;  // the same seed gives the same figures on every machine
};

// From samples of one surface to the closest points of another; in the models' own units.
struct DirectedDistance {
  // Over the area: from the face samples alone, since vertices lie where a simplifier does best or worst. A surface
  // without area is judged by its vertices.
  double rms = 0.0;
  double mean = 0.0;
  // Over face samples and vertices: a lower bound of the true maximum, which may lie between samples.
  double max = 0.0;
  glm::dvec3 max_position{0.0};  // the sample that is farthest off
  std::size_t samples = 0;       // face samples and vertices
};

struct MeshDistance {
  DirectedDistance forward;   // from a to b
  DirectedDistance backward;  // from b to a
  double diagonal = 0.0;      // of the bounds of a's surface; 0 if a is a single point

  // Symmetric: the larger of the two directions.
  double rms() const;
  double mean() const;
  double max() const;  // the (sampled) Hausdorff distance
  // The same divided by the diagonal; 0 if the diagonal is 0.
  double relative_rms() const;
  double relative_mean() const;
  double relative_max() const;
};

// Samples `from` and measures to the surface in `to`. Vertices that no triangle uses are not part of the surface.
// Fails as TriangleTree::build does. O(samples * log(triangles)), single-threaded.
Result<DirectedDistance> directed_distance(const TriangleMesh& from, const TriangleTree& to,
                                           const DistanceOptions& options = {});

// Both directions. Errors say which of the meshes ("first mesh: ...", "second mesh: ...") they are about.
Result<MeshDistance> mesh_distance(const TriangleMesh& a, const TriangleMesh& b, const DistanceOptions& options = {});

// The same where the tree of `a` (the reference) has been built already, because several meshes are compared with it.
Result<MeshDistance> mesh_distance(const TriangleMesh& a, const TriangleTree& tree_of_a, const TriangleMesh& b,
                                   const DistanceOptions& options = {});

}  // namespace fanstream
