// Reads a mesh file of any of six formats into triangles. Clean-up is a step of its own: mesh_cleaner.h.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/mesh/polygon_mesh.h"
#include "common/mesh/triangle_mesh.h"
#include "common/mesh/vertex_attributes.h"
#include "common/support/result.h"

namespace fanstream {

enum class MeshFormat { ply, stl, obj, off, gltf, glb };
std::string_view name(MeshFormat format);  // "PLY", "STL", ...

// Corners are numbered in 32 bits, three to a triangle, and the builder holds the whole mesh in memory at some hundred
// bytes per triangle: 2^28 triangles need about 27 GB. A triangle soup has three vertices per triangle.
inline constexpr std::size_t kMaxTriangles = std::size_t{1} << 28;
inline constexpr std::size_t kMaxVertices = 3 * kMaxTriangles;

// Greatest absolute coordinate. Fans hold positions as 32-bit floats (up to 3.4e38), and quadrics multiply up to six
// coordinates in 64-bit ones (up to 1.8e308): both stay finite below this, with room for a model's diagonal.
inline constexpr double kMaxCoordinate = 1e30;

struct ImportOptions {
  // Each at most the constant of its name. A file whose counts exceed them is refused before memory is taken for it.
  std::size_t max_vertices = kMaxVertices;
  std::size_t max_triangles = kMaxTriangles;
  // glTF may place one stored mesh many times, so a small file could fill the memory. Placed vertices, and triangles,
  // may number at most this or, where that is more, the bytes of the file.
  std::size_t max_placed_elements = std::size_t{1} << 26;
  // Reads texture coordinates and colours too, where the file has them. Vertices are then what has one position and one
  // set of attributes: where corners of one position differ in texture coordinates, it is repeated.
  bool keep_attributes = false;
  // Also give the faces as the file has them: polygons of OBJ, PLY and OFF, and OBJ's weights. Other formats give their
  // triangles. Not together with keep_attributes.
  bool keep_polygons = false;
};

struct ImportedMesh {
  TriangleMesh mesh;     // the model's own coordinates and winding; indices in range, positions finite, not cleaned
  PolygonMesh polygons;  // with keep_polygons, over the same vertices; repeated corners and the like as they are
  VertexAttributes attributes;  // of the vertices, with keep_attributes; else empty
  MeshFormat format = MeshFormat::ply;
  // By triangle, the number of the source's face that it is part of: a polygon's triangles, which follow one another,
  // share one. Empty where all faces are triangles (always for STL and glTF).
  std::vector<std::uint32_t> source_faces = {};
  std::vector<std::string> warnings;  // what was ignored or looked odd, each a whole sentence with its place
};

// Reads a mesh. The format is told by the content, and by the extension only where the content does not tell.
//
// - PLY (text, binary of both byte orders): any elements, property types and order; polygons and triangle strips.
// - STL (text, binary). OBJ: v and f; materials and free-form surfaces are ignored. OFF: also with colours, normals and
//   texture coordinates. Polygons are triangulated, concave ones by ear clipping.
// - glTF and GLB, version 2: the default scene (else the first, else all root nodes) with every node's transform;
//   triangles, strips and fans; sparse accessors; quantised positions; Draco compression. A mirroring transform flips
//   the winding. External buffers are read from the file's own folder or below it only. Images are never read. Skins
//   and morph targets stay in their rest pose, with a warning.
//
// Attributes are, with ImportOptions::keep_attributes: TEXCOORD_0 and COLOR_0 of glTF and GLB; vt, and colours behind
// positions, of OBJ; red, green, blue, alpha, u and v (s and t, texture_u and texture_v) of the vertices and texcoord
// of the faces of PLY; the colours and texture coordinates of COFF and STOFF. Parts of a scene without them get white
// and 0, 0. Colours of PLY, OBJ and OFF are taken for sRGB, their v for running up.
//
// Errors: not_found, io, bad_input (text in a binary, truncation, an index out of range, a coordinate that is not
// finite or beyond kMaxCoordinate, no triangles, ...), unsupported, limit. Each message begins with the path and names
// the byte, line or index. OBJ has no counts and no end mark, so one that is cut between two lines cannot be told from
// a whole one; text that ends within a line gets a warning.
//
// Memory: the file's size plus the result. Safe on untrusted files, and from several threads at once.
Result<ImportedMesh> import_mesh(const std::filesystem::path& path, const ImportOptions& options = {});

// The same for bytes in memory, as if `path` named a file that holds them: for its extension, for errors, and for the
// files that glTF names beside it.
Result<ImportedMesh> import_mesh_from_memory(std::string_view bytes, const std::filesystem::path& path,
                                             const ImportOptions& options = {});

}  // namespace fanstream
