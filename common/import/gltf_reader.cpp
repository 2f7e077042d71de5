// glTF 2.0 (Khronos, ISO/IEC 12113:2022): JSON and GLB.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat4x4.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/import/attribute_lists.h"
#include "common/import/gltf_accessor.h"
#include "common/import/gltf_container.h"
#include "common/import/gltf_draco.h"
#include "common/import/mesh_assembly.h"
#include "common/import/readers.h"
#include "common/import/text_scanner.h"
#include "common/import/tinygltf.h"

namespace fanstream {
namespace {

constexpr std::string_view kDraco = "KHR_draco_mesh_compression";

// Extensions that a reader of triangles may require: those understood, and those that only change the look.
bool is_harmless_extension(std::string_view extension) {
  constexpr std::array<std::string_view, 11> kPrefixes = {
      kDraco,         "KHR_mesh_quantization", "KHR_materials_", "KHR_texture_",   "KHR_lights_",        "KHR_xmp",
      "EXT_texture_", "MSFT_texture_",         "EXT_lights_",    "KHR_animation_", "KHR_node_visibility"};
  return std::any_of(kPrefixes.begin(), kPrefixes.end(), [&](std::string_view p) { return extension.starts_with(p); });
}

// tinygltf refuses index accessors without a buffer view, which is what Draco-compressed primitives have. Their indices
// come from Draco, so the mention is left out.
void detach_draco_indices(nlohmann::json& document) {
  const auto meshes = document.find("meshes");
  if (meshes == document.end() || !meshes->is_array()) return;
  for (nlohmann::json& mesh : *meshes) {
    const auto primitives = mesh.is_object() ? mesh.find("primitives") : mesh.end();
    if (!mesh.is_object() || primitives == mesh.end() || !primitives->is_array()) continue;
    for (nlohmann::json& primitive : *primitives) {
      if (!primitive.is_object() || !primitive.contains("extensions")) continue;
      const nlohmann::json& extensions = primitive["extensions"];
      if (extensions.is_object() && extensions.contains(kDraco)) primitive.erase("indices");
    }
  }
}

std::size_t count_primitives(const nlohmann::json& document) {
  std::size_t count = 0;
  const auto meshes = document.find("meshes");
  if (meshes == document.end() || !meshes->is_array()) return 0;
  for (const nlohmann::json& mesh : *meshes) {
    const auto primitives = mesh.is_object() ? mesh.find("primitives") : mesh.end();
    if (mesh.is_object() && primitives != mesh.end() && primitives->is_array()) count += primitives->size();
  }
  return count;
}

Result<tinygltf::Model> parse_model(const InputFile& file, nlohmann::json& document) {
  document.erase("buffers");
  document.erase("extensions");
  detach_draco_indices(document);
  const std::string text = document.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  tinygltf::Model model;
  tinygltf::TinyGLTF parser;
  std::string problem;
  std::string warning;
  if (text.size() > 0xFFFFFFFFU ||
      !parser.LoadASCIIFromString(&model, &problem, &warning, text.data(), static_cast<unsigned>(text.size()), "")) {
    std::replace(problem.begin(), problem.end(), '\n', ' ');
    return fail_in(file, ErrorKind::bad_input, "malformed glTF: " + problem);
  }
  std::size_t primitives = 0;
  for (const tinygltf::Mesh& mesh : model.meshes) primitives += mesh.primitives.size();
  if (primitives != count_primitives(document)) {
    return fail_in(file, ErrorKind::bad_input, "malformed glTF: a primitive has no valid attributes");
  }
  return model;
}

// Appends the triangles that `corners` form in the given primitive mode.
void add_triangles(int mode, const std::vector<std::uint32_t>& corners, std::vector<Triangle>& triangles) {
  const std::size_t n = corners.size();
  if (mode == TINYGLTF_MODE_TRIANGLES) {
    for (std::size_t i = 0; i + 2 < n; i += 3) triangles.push_back({corners[i], corners[i + 1], corners[i + 2]});
  } else if (mode == TINYGLTF_MODE_TRIANGLE_STRIP) {
    for (std::size_t i = 0; i + 2 < n; ++i) {
      const std::size_t odd = i % 2;
      triangles.push_back({corners[i], corners[i + 1 + odd], corners[i + 2 - odd]});
    }
  } else {
    for (std::size_t i = 1; i + 1 < n; ++i) triangles.push_back({corners[i], corners[i + 1], corners[0]});
  }
}

class GltfReader {
 public:
  GltfReader(const InputFile& file, const ImportOptions& options, const tinygltf::Model& model,
             const std::vector<GltfBuffer>& buffers)
      : file_(file), options_(options), model_(model), accessors_(file, options, model, buffers) {}

  Result<ImportedMesh> run() {
    for (const std::string& extension : model_.extensionsRequired) {
      if (is_harmless_extension(extension)) continue;
      return fail_in(
          file_, ErrorKind::unsupported,
          fmt::format("requires the glTF extension {}, which cannot be read: export without it", quote(extension)));
    }
    uses_of_mesh_.assign(model_.meshes.size(), 0);
    decoded_.resize(model_.meshes.size());
    for (const tinygltf::Node& node : model_.nodes) {
      if (has_mesh(node)) ++uses_of_mesh_[static_cast<std::size_t>(node.mesh)];
    }
    if (Result<void> done = place_scene(); !done) return tl::unexpected(done.error());
    finish_attributes(result_.attributes, result_.mesh.positions.size(), result_.warnings);
    note_oddities();
    return std::move(result_);
  }

 private:
  struct Decoded {
    TriangleMesh mesh;
    VertexAttributes attributes;
  };

  bool has_mesh(const tinygltf::Node& node) const {
    return node.mesh >= 0 && static_cast<std::size_t>(node.mesh) < model_.meshes.size();
  }

  // Primitives may share accessors and nodes may share meshes, so the file's size alone does not bound the result.
  bool exceeds_limits(std::size_t vertices, std::size_t triangles) const {
    const std::size_t placed_limit = std::max(options_.max_placed_elements, file_.bytes().size());
    return vertices > std::min(options_.max_vertices, placed_limit) ||
           triangles > std::min(options_.max_triangles, placed_limit);
  }

  struct Visit {
    int node;
    glm::dmat4 parent;
  };

  Result<void> place_scene() {
    Result<std::vector<int>> roots = find_roots();
    if (!roots) return tl::unexpected(roots.error());
    std::vector<bool> seen(model_.nodes.size(), false);
    std::vector<Visit> stack;
    for (auto root = roots->rbegin(); root != roots->rend(); ++root) stack.push_back({*root, glm::dmat4(1)});
    while (!stack.empty()) {
      const Visit visit = stack.back();
      stack.pop_back();
      if (visit.node < 0 || static_cast<std::size_t>(visit.node) >= model_.nodes.size()) {
        return fail_in(file_, ErrorKind::bad_input,
                       fmt::format("the scene names node {}, which does not exist", visit.node));
      }
      const auto index = static_cast<std::size_t>(visit.node);
      if (seen[index]) {
        return fail_in(file_, ErrorKind::bad_input,
                       fmt::format("node {} is in the scene twice, or is its own ancestor", index));
      }
      seen[index] = true;
      const tinygltf::Node& node = model_.nodes[index];
      const Result<glm::dmat4> local = transform_of(index);
      if (!local) return tl::unexpected(local.error());
      const glm::dmat4 world = visit.parent * *local;
      if (node.mesh >= 0) {
        if (Result<void> done = place_mesh(index, world); !done) return done;
      }
      for (auto child = node.children.rbegin(); child != node.children.rend(); ++child)
        stack.push_back({*child, world});
    }
    return {};
  }

  Result<std::vector<int>> find_roots() const {
    if (!model_.scenes.empty()) {
      const int scene = model_.defaultScene < 0 ? 0 : model_.defaultScene;
      if (static_cast<std::size_t>(scene) >= model_.scenes.size()) {
        return fail_in(file_, ErrorKind::bad_input, fmt::format("the default scene {} does not exist", scene));
      }
      return model_.scenes[static_cast<std::size_t>(scene)].nodes;
    }
    std::vector<bool> is_child(model_.nodes.size(), false);
    for (const tinygltf::Node& node : model_.nodes) {
      for (const int child : node.children) {
        if (child >= 0 && static_cast<std::size_t>(child) < is_child.size())
          is_child[static_cast<std::size_t>(child)] = true;
      }
    }
    std::vector<int> roots;
    for (std::size_t i = 0; i < is_child.size(); ++i) {
      if (!is_child[i]) roots.push_back(static_cast<int>(i));
    }
    return roots;
  }

  Result<glm::dmat4> transform_of(std::size_t index) const {
    const tinygltf::Node& node = model_.nodes[index];
    const auto has_size = [](const std::vector<double>& values, std::size_t size) {
      return values.empty() || values.size() == size;
    };
    if (!has_size(node.matrix, 16) || !has_size(node.translation, 3) || !has_size(node.rotation, 4) ||
        !has_size(node.scale, 3)) {
      return fail_in(file_, ErrorKind::bad_input, fmt::format("node {} has a transform of the wrong length", index));
    }
    glm::dmat4 matrix(1);
    if (!node.matrix.empty()) {
      for (int i = 0; i < 16; ++i) matrix[i / 4][i % 4] = node.matrix[static_cast<std::size_t>(i)];
      return matrix;
    }
    if (!node.rotation.empty()) {
      const glm::dquat rotation(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]);
      const double length = glm::length(rotation);
      if (length > 0) matrix = glm::mat4_cast(rotation / length);
    }
    for (int axis = 0; axis < 3; ++axis) {
      if (!node.scale.empty()) matrix[axis] *= node.scale[static_cast<std::size_t>(axis)];
      if (!node.translation.empty()) matrix[3][axis] = node.translation[static_cast<std::size_t>(axis)];
    }
    return matrix;
  }

  Result<void> place_mesh(std::size_t node_index, const glm::dmat4& world) {
    const tinygltf::Node& node = model_.nodes[node_index];
    if (!has_mesh(node)) {
      return fail_in(file_, ErrorKind::bad_input,
                     fmt::format("node {} names mesh {}, which does not exist", node_index, node.mesh));
    }
    if (node.skin >= 0) ++skinned_nodes_;
    if (node.extensions.contains("EXT_mesh_gpu_instancing")) ++gpu_instanced_nodes_;
    const auto mesh_index = static_cast<std::size_t>(node.mesh);
    if (!decoded_[mesh_index]) {
      Result<Decoded> decoded = decode_mesh(mesh_index);
      if (!decoded) return tl::unexpected(decoded.error());
      decoded_[mesh_index] = std::move(*decoded);
    }
    if (Result<void> done = place(*decoded_[mesh_index], node_index, world); !done) return done;
    if (--uses_of_mesh_[mesh_index] == 0) decoded_[mesh_index].reset();
    return {};
  }

  Result<void> place(const Decoded& decoded, std::size_t node_index, const glm::dmat4& world) {
    const TriangleMesh& source = decoded.mesh;
    TriangleMesh& mesh = result_.mesh;
    const std::size_t vertices = mesh.positions.size() + source.positions.size();
    const std::size_t triangles = mesh.triangles.size() + source.triangles.size();
    if (exceeds_limits(vertices, triangles)) {
      return fail_in(
          file_, ErrorKind::limit,
          fmt::format("node {}: the scene grows to {} vertices and {} triangles, more than is allowed for this "
                      "file",
                      node_index, vertices, triangles));
    }
    const auto first = static_cast<VertexId>(mesh.positions.size());
    append_attributes(result_.attributes, first, decoded.attributes);
    for (const glm::dvec3& p : source.positions) {
      const glm::dvec3 position(world * glm::dvec4(p, 1));
      if (const auto fault = position_fault(position)) {
        return fail_in(file_, ErrorKind::bad_input,
                       fmt::format("node {}: vertex {} of mesh {} {}", node_index, &p - source.positions.data(),
                                   model_.nodes[node_index].mesh, *fault));
      }
      mesh.positions.push_back(position);
    }
    const bool mirrored = glm::determinant(glm::dmat3(world)) < 0;
    for (const Triangle& t : source.triangles) {
      mesh.triangles.push_back({first + t[0], first + t[mirrored ? 2 : 1], first + t[mirrored ? 1 : 2]});
    }
    return {};
  }

  // All triangles of one mesh in its own coordinates.
  Result<Decoded> decode_mesh(std::size_t mesh_index) {
    const tinygltf::Mesh& mesh = model_.meshes[mesh_index];
    Decoded decoded;
    std::map<std::array<int, 3>, Block> blocks;
    for (std::size_t p = 0; p < mesh.primitives.size(); ++p) {
      const std::string what = fmt::format("mesh {}, primitive {}", mesh_index, p);
      const tinygltf::Primitive& primitive = mesh.primitives[p];
      if (primitive.mode < TINYGLTF_MODE_TRIANGLES || primitive.mode > TINYGLTF_MODE_TRIANGLE_FAN) {
        ++skipped_primitives_;
        continue;
      }
      const bool draco = primitive.extensions.contains(std::string(kDraco));
      Result<void> done = draco ? add_draco(primitive, what, decoded) : add_plain(primitive, what, blocks, decoded);
      if (!done) return tl::unexpected(done.error());
      if (exceeds_limits(decoded.mesh.positions.size(), decoded.mesh.triangles.size())) {
        return fail_in(file_, ErrorKind::limit, what + ": more vertices or triangles than is allowed for this file");
      }
    }
    for (const double weight : mesh.weights) morphed_meshes_ += weight != 0 ? 1 : 0;
    return decoded;
  }

  // The accessor of an attribute that is wanted; -1 where it is not, or not there.
  int attribute_of(const tinygltf::Primitive& primitive, const char* name) const {
    const auto attribute = primitive.attributes.find(name);
    return options_.keep_attributes && attribute != primitive.attributes.end() ? attribute->second : -1;
  }

  std::optional<DracoAttribute> draco_attribute(const tinygltf::Primitive& primitive, const tinygltf::Value& ids,
                                                const char* name) const {
    const tinygltf::Value id = ids.Get(name);
    if (!options_.keep_attributes || !id.IsInt() || id.GetNumberAsInt() < 0) return std::nullopt;
    const int accessor = attribute_of(primitive, name);
    const bool known = accessor >= 0 && static_cast<std::size_t>(accessor) < model_.accessors.size();
    return DracoAttribute{static_cast<std::uint32_t>(id.GetNumberAsInt()),
                          known && model_.accessors[static_cast<std::size_t>(accessor)].normalized};
  }

  Result<void> add_draco(const tinygltf::Primitive& primitive, const std::string& what, Decoded& decoded) {
    const tinygltf::Value& extension = primitive.extensions.at(std::string(kDraco));
    const tinygltf::Value view = extension.Get("bufferView");
    const tinygltf::Value attributes = extension.Get("attributes");
    const tinygltf::Value position = attributes.IsObject() ? attributes.Get("POSITION") : tinygltf::Value();
    if (!view.IsInt() || !position.IsInt() || position.GetNumberAsInt() < 0) {
      return fail_in(file_, ErrorKind::bad_input, what + ": its Draco extension names no bufferView or no POSITION");
    }
    const Result<std::string_view> bytes = accessors_.view_bytes(view.GetNumberAsInt());
    if (!bytes) return tl::unexpected(bytes.error());
    const DracoAttributes wanted{static_cast<std::uint32_t>(position.GetNumberAsInt()),
                                 draco_attribute(primitive, attributes, "TEXCOORD_0"),
                                 draco_attribute(primitive, attributes, "COLOR_0")};
    const Result<DracoPrimitive> part = decode_draco_primitive(file_, *bytes, wanted, what, options_);
    if (!part) return tl::unexpected(part.error());
    TriangleMesh& mesh = decoded.mesh;
    const auto first = static_cast<VertexId>(mesh.positions.size());
    append_attributes(decoded.attributes, first, part->attributes);
    mesh.positions.insert(mesh.positions.end(), part->mesh.positions.begin(), part->mesh.positions.end());
    for (const Triangle& t : part->mesh.triangles) mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    return {};
  }

  // The vertices of one accessor within a decoded mesh; primitives often share an accessor. Those with different
  // attributes do not share vertices.
  struct Block {
    VertexId first;
    std::size_t count;
  };

  Result<void> add_plain(const tinygltf::Primitive& primitive, const std::string& what,
                         std::map<std::array<int, 3>, Block>& blocks, Decoded& decoded) {
    const auto attribute = primitive.attributes.find("POSITION");
    if (attribute == primitive.attributes.end()) {
      ++skipped_primitives_;
      return {};
    }
    const std::array<int, 3> key{attribute->second, attribute_of(primitive, "TEXCOORD_0"),
                                 attribute_of(primitive, "COLOR_0")};
    TriangleMesh& mesh = decoded.mesh;
    auto block = blocks.find(key);
    if (block == blocks.end()) {
      const Result<std::vector<glm::dvec3>> positions = accessors_.positions(attribute->second);
      if (!positions) return tl::unexpected(with_what(positions.error(), what));
      const auto first = static_cast<VertexId>(mesh.positions.size());
      const Result<VertexAttributes> attributes = attributes_of(key, positions->size(), what);
      if (!attributes) return tl::unexpected(attributes.error());
      append_attributes(decoded.attributes, first, *attributes);
      block = blocks.emplace(key, Block{first, positions->size()}).first;
      mesh.positions.insert(mesh.positions.end(), positions->begin(), positions->end());
    }
    const Result<std::vector<std::uint32_t>> corners = corners_of(primitive, block->second, what);
    if (!corners) return tl::unexpected(corners.error());
    if (corners->size() > 3 * options_.max_triangles)
      return fail_in(file_, ErrorKind::limit, what + ": too many indices");
    add_triangles(primitive.mode, *corners, mesh.triangles);
    return {};
  }

  // `key`: the accessors of positions, texture coordinates and colours.
  Result<VertexAttributes> attributes_of(const std::array<int, 3>& key, std::size_t vertices,
                                         const std::string& what) const {
    VertexAttributes attributes;
    if (key[1] >= 0) {
      Result<std::vector<glm::dvec2>> values = accessors_.texture_coordinates(key[1]);
      if (!values) return tl::unexpected(with_what(values.error(), what));
      attributes.texture_coordinates = std::move(*values);
    }
    if (key[2] >= 0) {
      Result<std::vector<glm::vec4>> values = accessors_.colors(key[2]);
      if (!values) return tl::unexpected(with_what(values.error(), what));
      attributes.colors = std::move(*values);
    }
    for (const auto& [accessor, count] :
         {std::pair{key[1], attributes.texture_coordinates.size()}, std::pair{key[2], attributes.colors.size()}}) {
      if (accessor < 0 || count == vertices) continue;
      return fail_in(file_, ErrorKind::bad_input,
                     fmt::format("{}: {} positions, but {} values in accessor {}", what, vertices, count, accessor));
    }
    return attributes;
  }

  Result<std::vector<std::uint32_t>> corners_of(const tinygltf::Primitive& primitive, const Block& block,
                                                const std::string& what) const {
    std::vector<std::uint32_t> corners;
    if (primitive.indices < 0) {
      corners.resize(block.count);
      for (std::size_t i = 0; i < corners.size(); ++i) corners[i] = block.first + static_cast<VertexId>(i);
      return corners;
    }
    Result<std::vector<std::uint32_t>> indices = accessors_.indices(primitive.indices);
    if (!indices) return tl::unexpected(with_what(indices.error(), what));
    for (std::size_t i = 0; i < indices->size(); ++i) {
      std::uint32_t& index = (*indices)[i];
      if (index >= block.count) {
        return fail_in(file_, ErrorKind::bad_input,
                       fmt::format("{}: index {} of accessor {} names vertex {}, but there are {} vertices", what, i,
                                   primitive.indices, index, block.count));
      }
      index += block.first;
    }
    return indices;
  }

  Error with_what(const Error& error, const std::string& what) const {
    Error detailed = error;
    const std::string prefix = file_.name() + ": ";
    if (detailed.message.starts_with(prefix)) detailed.message.insert(prefix.size(), what + ": ");
    return detailed;
  }

  void note_oddities() {
    const auto note = [&](std::size_t count, std::string_view what) {
      if (count > 0) result_.warnings.push_back(fmt::format("{} {}", count, what));
    };
    note(skipped_primitives_, "primitives of points, lines or without positions were ignored.");
    note(skinned_nodes_, "nodes are skinned: they were imported in their rest pose.");
    note(morphed_meshes_, "morph target weights were ignored.");
    note(gpu_instanced_nodes_, "nodes use EXT_mesh_gpu_instancing: only their plain mesh was imported.");
  }

  const InputFile& file_;
  const ImportOptions& options_;
  const tinygltf::Model& model_;
  GltfAccessors accessors_;
  ImportedMesh result_;
  std::vector<std::size_t> uses_of_mesh_;
  std::vector<std::optional<Decoded>> decoded_;  // per mesh, while nodes still use it
  std::size_t skipped_primitives_ = 0;
  std::size_t skinned_nodes_ = 0;
  std::size_t morphed_meshes_ = 0;
  std::size_t gpu_instanced_nodes_ = 0;
};

}  // namespace

Result<ImportedMesh> read_gltf(const InputFile& file, const ImportOptions& options) {
  const Result<GltfParts> parts = split_gltf(file);
  if (!parts) return tl::unexpected(parts.error());
  Result<nlohmann::json> document = parse_gltf_json(file, parts->json);
  if (!document) return tl::unexpected(document.error());
  const Result<std::vector<GltfBuffer>> buffers = load_gltf_buffers(file, *document, parts->binary);
  if (!buffers) return tl::unexpected(buffers.error());
  const Result<tinygltf::Model> model = parse_model(file, *document);
  if (!model) return tl::unexpected(model.error());
  return GltfReader(file, options, *model, *buffers).run();
}

}  // namespace fanstream
