// Triangle meshes to files that other programs read.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "common/mesh/triangle_mesh.h"
#include "common/mesh/vertex_attributes.h"
#include "common/support/result.h"

namespace fanstream {

enum class MeshFileFormat { ply, obj, glb };

// By the name's extension, in any case of letters; fails (usage) for others, naming those that exist.
Result<MeshFileFormat> mesh_file_format(const std::filesystem::path& path);

// The bytes of a file, the vertices and triangles in their order, every vertex kept:
//   ply  binary little-endian; coordinates as float where all of them are floats exactly, else as double
//   obj  text, every coordinate with as many digits as give it back exactly
//   glb  glTF 2.0, coordinates rounded to float (the format knows no other)
// Texture coordinates and colours, where there are any, one of each for every vertex:
//   ply  s and t as float, v running up; red, green, blue and alpha in eight bits, sRGB
//   obj  vt with the vertex's number, v running up; colours behind the positions, sRGB, without opacity
//   glb  TEXCOORD_0 as float, COLOR_0 in sixteen bits, linear; no material and no image is named
// Fails (usage) for a mesh without triangles, (bad_input) for an index outside the vertices or a coordinate that is not
// finite (glb: beyond float) or attributes that are not as many as the vertices, (limit) where a glb would exceed 4 GB.
Result<std::vector<std::uint8_t>> encode_mesh(std::span<const glm::dvec3> positions,
                                              std::span<const Triangle> triangles, MeshFileFormat format,
                                              const VertexAttributes& attributes = {});

// Writes by write_file_atomically what encode_mesh gives; errors begin with the path.
Result<void> export_mesh(const std::filesystem::path& path, std::span<const glm::dvec3> positions,
                         std::span<const Triangle> triangles, const VertexAttributes& attributes = {});

}  // namespace fanstream
