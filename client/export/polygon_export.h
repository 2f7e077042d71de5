// Meshes of polygons to files that other programs read, faces and vertices in their order.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "client/export/mesh_export.h"
#include "common/mesh/polygon_mesh.h"
#include "common/support/result.h"

namespace fanstream {

//   ply  binary little-endian, polygons; places as encode_mesh writes them (PLY has no weights)
//   obj  text, polygons; `v x y z w` where some weight is not 1
//   glb  triangles, as encode_mesh writes them
// Fails as encode_mesh.
Result<std::vector<std::uint8_t>> encode_polygons(const PolygonMesh& mesh, MeshFileFormat format);

// Writes by write_file_atomically what encode_polygons gives; errors begin with the path.
Result<void> export_polygons(const std::filesystem::path& path, const PolygonMesh& mesh);

}  // namespace fanstream
