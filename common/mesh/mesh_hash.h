// One number for a mesh, whatever the order of its vertices and faces.
#pragma once

#include <string>

#include "common/mesh/triangle_mesh.h"

namespace fanstream {

// 32 hexadecimal digits. Equal for meshes with the same oriented faces over the same positions (all bits, as doubles),
// however vertices and faces are numbered and wherever a face starts; a turned-over, missing or doubled face changes
// it. Sums of XXH3-128 of the faces: it finds mistakes, not forgery. Precondition: indices in range. Linear time.
std::string mesh_hash(const TriangleMesh& mesh);

}  // namespace fanstream
