// Meshes as the bytes of files, one plain writer per format, for tests of import.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "common/mesh/triangle_mesh.h"

namespace fanstream::testing {

// The mesh with coordinates rounded to 32-bit floats, which is what STL and glTF can hold.
TriangleMesh in_float_precision(TriangleMesh mesh);

std::string ply_text(const TriangleMesh& mesh);
// Positions as doubles, indices as lists of uchar int.
std::string ply_binary(const TriangleMesh& mesh, bool big_endian);
std::string stl_text(const TriangleMesh& mesh);
std::string stl_binary(const TriangleMesh& mesh);
std::string obj_text(const TriangleMesh& mesh);
std::string off_text(const TriangleMesh& mesh);

// A glTF document under construction: the JSON, and the bytes of buffer 0.
struct GltfDraft {
  nlohmann::json json = {{"asset", {{"version", "2.0"}}}};
  std::string binary;

  // Appends bytes, aligned to 4, as a bufferView; returns its index.
  int add_view(const std::string& bytes);
  // Appends an accessor; returns its index.
  int add_accessor(int view, int component_type, const std::string& type, std::size_t count);
  int add_positions(const TriangleMesh& mesh);                                     // floats
  int add_indices(const std::vector<std::uint32_t>& indices, int component_type);  // 5121, 5123 or 5125
  // Appends a mesh of one primitive and returns its index.
  int add_mesh(nlohmann::json primitive);
  // Appends a node and returns its index. The caller lists it in a scene where the document has scenes.
  int add_node(nlohmann::json node);
  void use_scene(const std::vector<int>& nodes);

  std::string as_glb() const;
  std::string as_gltf_with_uri(const std::string& uri) const;
  std::string as_gltf_with_data_uri() const;
};

GltfDraft gltf_draft(const TriangleMesh& mesh, int index_type = 5125);
// The same mesh, compressed by Draco at 14 bits with Edgebreaker, or losslessly in sequence.
GltfDraft draco_gltf_draft(const TriangleMesh& mesh, bool lossless);

}  // namespace fanstream::testing
