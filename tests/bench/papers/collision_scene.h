// What collision is measured on: a model at several sizes, restored where a plane touches it, the place of contact
// going over the model.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "client/collision/local_restoration.h"
#include "client/collision/plane_contacts.h"

namespace fanstream::bench {

// The mesh reduced to about these many triangles, in rising order, exactly so where it is closed and the number even;
// the mesh itself where it has no more than asked for.
Result<std::vector<TriangleMesh>> reduced_meshes(const TriangleMesh& mesh, const std::vector<std::uint32_t>& triangles);

// A mesh as a client has it: an asset of small cells, all of it held, and measured.
struct CollisionSubject {
  TriangleMesh full;                          // on the asset's grid
  SurfacePatch flat;                          // the same
  std::unique_ptr<LocalRestoration> local;    // for a focus
  std::unique_ptr<LocalRestoration> refined;  // refined everywhere, under the same tree
  double diagonal = 0.0;
};
Result<CollisionSubject> make_subject(const TriangleMesh& mesh);

// One frame: the place of contact, and the six walls of a room around the model: the first is parallel to the surface
// at the place of contact and cuts a twentieth of the radius deep; the others are near the model, but do not touch it.
struct ContactFrame {
  Focus focus;
  std::array<Plane, 6> planes;
  // A ball of half the focus's radius that dips in as deep as the plane.
  TriangleMesh ball() const;
};
using ContactPath = std::vector<ContactFrame>;

// Along the longest curve in which the plane x = middle, a little tilted, cuts the mesh; a frame goes on by a twentieth
// of the radius. No more than `most` frames. Fails (bad_input) where the plane does not cut the mesh.
Result<ContactPath> contact_path(const TriangleMesh& mesh, double radius, std::size_t most);
// Stretches of that path, evenly spread over the curve: the same places of a model at every size and radius.
Result<std::vector<ContactPath>> contact_stretches(const TriangleMesh& mesh, double radius, std::size_t stretches,
                                                   std::size_t frames_each);

}  // namespace fanstream::bench
