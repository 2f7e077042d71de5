// Polygons over triangle meshes, as if an importer had cut them.
#pragma once

#include <array>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "common/mesh/triangle_joining.h"
#include "common/mesh/triangle_mesh.h"

namespace fanstream::testing {

// By triangle, a number of the face that it is part of: connected groups of up to `most` triangles, grown at random, of
// which many are no discs or touch themselves.
std::vector<std::uint32_t> random_source_faces(const TriangleMesh& mesh, std::uint32_t most, std::uint64_t seed);
// Triangles 2 i and 2 i + 1 are a quad: right for make_torus, make_grid, make_terrain and make_open_cylinder.
std::vector<std::uint32_t> paired_source_faces(const TriangleMesh& mesh);

// Faces of more than three corners as the places of their corners, each begun at its least, in order.
using PlacedFace = std::vector<std::array<double, 3>>;
PlacedFace placed(std::span<const VertexId> face, const std::vector<glm::dvec3>& positions);
std::vector<PlacedFace> placed_polygons(const JoinedFaces& faces, const std::vector<glm::dvec3>& positions);
// Those that the source faces stand for, on the mesh's own positions.
std::vector<PlacedFace> source_polygons(const TriangleMesh& mesh, const std::vector<std::uint32_t>& source_faces);

// OBJ of the mesh with polygons where source faces join triangles.
std::string obj_text(const TriangleMesh& mesh, const std::vector<std::uint32_t>& source_faces);

}  // namespace fanstream::testing
