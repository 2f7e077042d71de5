#include "tests/support/mesh_files.h"

#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstring>

namespace fanstream::testing {
namespace {

template <class T>
void append_value(std::string& bytes, T value, bool big_endian = false) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  if (big_endian) std::reverse(raw, raw + sizeof value);
  bytes.append(raw, sizeof value);
}

std::string ply_header(const TriangleMesh& mesh, std::string_view encoding) {
  return fmt::format(
      "ply\nformat {} 1.0\ncomment written by a test\nelement vertex {}\nproperty double x\nproperty double y\n"
      "property double z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
      encoding, mesh.positions.size(), mesh.triangles.size());
}

std::string base64(const std::string& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      bits = bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += i + k <= bytes.size() ? kDigits[bits >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

}  // namespace

TriangleMesh in_float_precision(TriangleMesh mesh) {
  for (glm::dvec3& p : mesh.positions) {
    for (int axis = 0; axis < 3; ++axis) {
      // Volatile because g++ 12 drops the rounding where it vectorises dvec3(vec3(p)).
      const volatile auto rounded = static_cast<float>(p[axis]);
      p[axis] = rounded;
    }
  }
  return mesh;
}

std::string ply_text(const TriangleMesh& mesh) {
  std::string text = ply_header(mesh, "ascii");
  for (const glm::dvec3& p : mesh.positions) text += fmt::format("{} {} {}\n", p.x, p.y, p.z);
  for (const Triangle& t : mesh.triangles) text += fmt::format("3 {} {} {}\n", t[0], t[1], t[2]);
  return text;
}

std::string ply_binary(const TriangleMesh& mesh, bool big_endian) {
  std::string bytes = ply_header(mesh, big_endian ? "binary_big_endian" : "binary_little_endian");
  for (const glm::dvec3& p : mesh.positions) {
    for (const double x : {p.x, p.y, p.z}) append_value(bytes, x, big_endian);
  }
  for (const Triangle& t : mesh.triangles) {
    append_value(bytes, std::uint8_t{3});
    for (const VertexId v : t) append_value(bytes, v, big_endian);
  }
  return bytes;
}

std::string stl_text(const TriangleMesh& mesh) {
  std::string text = "solid a test\n";
  for (const Triangle& t : mesh.triangles) {
    text += "  facet normal 0 0 nan\n    outer loop\n";
    for (const VertexId v : t) {
      const glm::dvec3& p = mesh.positions[v];
      text += fmt::format("      vertex {} {} {}\n", p.x, p.y, p.z);
    }
    text += "    endloop\n  endfacet\n";
  }
  return text + "endsolid a test\n";
}

std::string stl_binary(const TriangleMesh& mesh) {
  std::string bytes("solid but binary");  // a header that misleads readers which trust it
  bytes.resize(80, ' ');
  append_value(bytes, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const Triangle& t : mesh.triangles) {
    for (int axis = 0; axis < 3; ++axis) append_value(bytes, 0.0F);
    for (const VertexId v : t) {
      for (int axis = 0; axis < 3; ++axis) append_value(bytes, static_cast<float>(mesh.positions[v][axis]));
    }
    append_value(bytes, std::uint16_t{0});
  }
  return bytes;
}

std::string obj_text(const TriangleMesh& mesh) {
  std::string text = "# a test\no thing\n";
  for (const glm::dvec3& p : mesh.positions) text += fmt::format("v {} {} {}\n", p.x, p.y, p.z);
  for (const Triangle& t : mesh.triangles) text += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  return text;
}

std::string off_text(const TriangleMesh& mesh) {
  std::string text = fmt::format("OFF\n# a test\n{} {} 0\n", mesh.positions.size(), mesh.triangles.size());
  for (const glm::dvec3& p : mesh.positions) text += fmt::format("{} {} {}\n", p.x, p.y, p.z);
  for (const Triangle& t : mesh.triangles) text += fmt::format("3 {} {} {}\n", t[0], t[1], t[2]);
  return text;
}

int GltfDraft::add_view(const std::string& bytes) {
  json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", bytes.size()}});
  binary += bytes;
  binary.resize((binary.size() + 3) / 4 * 4);
  return static_cast<int>(json["bufferViews"].size()) - 1;
}

int GltfDraft::add_accessor(int view, int component_type, const std::string& type, std::size_t count) {
  json["accessors"].push_back({{"componentType", component_type}, {"type", type}, {"count", count}});
  if (view >= 0) json["accessors"].back()["bufferView"] = view;
  return static_cast<int>(json["accessors"].size()) - 1;
}

int GltfDraft::add_positions(const TriangleMesh& mesh) {
  std::string bytes;
  for (const glm::dvec3& p : mesh.positions) {
    for (int axis = 0; axis < 3; ++axis) append_value(bytes, static_cast<float>(p[axis]));
  }
  return add_accessor(add_view(bytes), 5126, "VEC3", mesh.positions.size());
}

int GltfDraft::add_indices(const std::vector<std::uint32_t>& indices, int component_type) {
  std::string bytes;
  for (const std::uint32_t index : indices) {
    if (component_type == 5121) append_value(bytes, static_cast<std::uint8_t>(index));
    if (component_type == 5123) append_value(bytes, static_cast<std::uint16_t>(index));
    if (component_type == 5125) append_value(bytes, index);
  }
  return add_accessor(add_view(bytes), component_type, "SCALAR", indices.size());
}

int GltfDraft::add_mesh(nlohmann::json primitive) {
  json["meshes"].push_back({{"primitives", nlohmann::json::array({std::move(primitive)})}});
  return static_cast<int>(json["meshes"].size()) - 1;
}

int GltfDraft::add_node(nlohmann::json node) {
  json["nodes"].push_back(std::move(node));
  return static_cast<int>(json["nodes"].size()) - 1;
}

void GltfDraft::use_scene(const std::vector<int>& nodes) {
  json["scenes"] = nlohmann::json::array({{{"nodes", nodes}}});
  json["scene"] = 0;
}

std::string GltfDraft::as_glb() const {
  nlohmann::json document = json;
  if (!binary.empty()) document["buffers"] = nlohmann::json::array({{{"byteLength", binary.size()}}});
  std::string text = document.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string bytes = "glTF";
  append_value(bytes, std::uint32_t{2});
  append_value(bytes, static_cast<std::uint32_t>(12 + 8 + text.size() + (binary.empty() ? 0 : 8 + binary.size())));
  append_value(bytes, static_cast<std::uint32_t>(text.size()));
  bytes += "JSON" + text;
  if (binary.empty()) return bytes;
  append_value(bytes, static_cast<std::uint32_t>(binary.size()));
  bytes.append("BIN\0", 4);
  return bytes + binary;
}

std::string GltfDraft::as_gltf_with_uri(const std::string& uri) const {
  nlohmann::json document = json;
  document["buffers"] = nlohmann::json::array({{{"byteLength", binary.size()}, {"uri", uri}}});
  return document.dump(1);
}

std::string GltfDraft::as_gltf_with_data_uri() const {
  return as_gltf_with_uri("data:application/octet-stream;base64," + base64(binary));
}

GltfDraft gltf_draft(const TriangleMesh& mesh, int index_type) {
  GltfDraft draft;
  std::vector<std::uint32_t> indices;
  for (const Triangle& t : mesh.triangles) indices.insert(indices.end(), t.begin(), t.end());
  const int positions = draft.add_positions(mesh);
  const int accessor = draft.add_indices(indices, index_type);
  draft.add_node({{"mesh", draft.add_mesh({{"attributes", {{"POSITION", positions}}}, {"indices", accessor}})}});
  draft.use_scene({0});
  return draft;
}

GltfDraft draco_gltf_draft(const TriangleMesh& mesh, bool lossless) {
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(static_cast<int>(mesh.triangles.size()));
  const int attribute = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    glm::vec3 corners[3];
    for (std::size_t k = 0; k < 3; ++k) corners[k] = glm::vec3(mesh.positions[mesh.triangles[i][k]]);
    builder.SetAttributeValuesForFace(attribute, draco::FaceIndex(static_cast<std::uint32_t>(i)), &corners[0],
                                      &corners[1], &corners[2]);
  }
  const std::unique_ptr<draco::Mesh> source = builder.Finalize();
  draco::Encoder encoder;
  encoder.SetEncodingMethod(lossless ? draco::MESH_SEQUENTIAL_ENCODING : draco::MESH_EDGEBREAKER_ENCODING);
  if (!lossless) encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, 14);
  draco::EncoderBuffer encoded;
  if (!encoder.EncodeMeshToBuffer(*source, &encoded).ok())
    throw std::runtime_error("Draco cannot encode the test mesh");
  GltfDraft draft;
  const int view = draft.add_view({encoded.data(), encoded.size()});
  const int positions = draft.add_accessor(-1, 5126, "VEC3", mesh.positions.size());
  const int indices = draft.add_accessor(-1, 5125, "SCALAR", 3 * mesh.triangles.size());
  const std::uint32_t id = source->attribute(attribute)->unique_id();
  draft.json["extensionsUsed"] = draft.json["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  draft.add_node({{"mesh", draft.add_mesh({{"attributes", {{"POSITION", positions}}},
                                           {"indices", indices},
                                           {"extensions",
                                            {{"KHR_draco_mesh_compression",
                                              {{"bufferView", view}, {"attributes", {{"POSITION", id}}}}}}}})}});
  draft.use_scene({0});
  return draft;
}

}  // namespace fanstream::testing
