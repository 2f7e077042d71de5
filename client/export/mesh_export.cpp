#include "client/export/mesh_export.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <glm/common.hpp>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

#include "client/export/file_bytes.h"
#include "common/mesh/srgb.h"
#include "common/support/atomic_file.h"

namespace fanstream {
namespace {

using namespace detail;

Result<void> check_mesh(std::span<const glm::dvec3> positions, std::span<const Triangle> triangles,
                        MeshFileFormat format) {
  if (triangles.empty()) return fail(ErrorKind::usage, "the mesh has no triangles to write");
  for (std::size_t i = 0; i < positions.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const double x = positions[i][axis];
      if (!std::isfinite(x))
        return fail(ErrorKind::bad_input, fmt::format("vertex {}: {} is not a finite number", i, x));
      if (format == MeshFileFormat::glb && !in_float_range(x)) {
        return fail(ErrorKind::bad_input, fmt::format("vertex {}: {} is too large for glTF; write .ply", i, x));
      }
    }
  }
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const VertexId largest = *std::max_element(triangles[i].begin(), triangles[i].end());
    if (largest >= positions.size()) {
      return fail(ErrorKind::bad_input, fmt::format("triangle {} names vertex {} of {}", i, largest, positions.size()));
    }
  }
  return {};
}

// A colour's parts as eight bits hold them.
std::array<std::uint8_t, 4> srgb_bytes(const glm::vec4& color) {
  const auto byte = [](float x) { return static_cast<std::uint8_t>(std::lround(std::clamp(x, 0.0F, 1.0F) * 255.0F)); };
  return {byte(srgb_of_linear(color.r)), byte(srgb_of_linear(color.g)), byte(srgb_of_linear(color.b)), byte(color.a)};
}

// v from running down to running up.
glm::vec2 upward(const glm::dvec2& uv) { return {uv.x, 1.0 - uv.y}; }

Bytes encode_ply(std::span<const glm::dvec3> positions, std::span<const Triangle> triangles,
                 const VertexAttributes& attributes) {
  const bool floats = exactly_floats(positions);
  const bool textured = !attributes.texture_coordinates.empty();
  const bool colored = !attributes.colors.empty();
  Bytes bytes;
  bytes.reserve(512 + positions.size() * ((floats ? 12 : 24) + 12U) + triangles.size() * 13);
  append_text(bytes, "ply\nformat binary_little_endian 1.0\ncomment Fanstream\n");
  append_text(bytes, fmt::format("element vertex {0}\nproperty {1} x\nproperty {1} y\nproperty {1} z\n",
                                 positions.size(), floats ? "float" : "double"));
  if (textured) append_text(bytes, "property float s\nproperty float t\n");
  if (colored) {
    append_text(bytes, "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n");
  }
  append_text(bytes,
              fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n", triangles.size()));
  for (std::size_t v = 0; v < positions.size(); ++v) {
    append_place(bytes, positions[v], floats);
    if (textured) append(bytes, upward(attributes.texture_coordinates[v]));
    if (colored) append(bytes, srgb_bytes(attributes.colors[v]));
  }
  for (const Triangle& triangle : triangles) {
    append(bytes, std::uint8_t{3});
    append(bytes, triangle);
  }
  return bytes;
}

Bytes encode_obj(std::span<const glm::dvec3> positions, std::span<const Triangle> triangles,
                 const VertexAttributes& attributes) {
  Bytes bytes;
  const auto out = std::back_inserter(bytes);
  append_text(bytes, "# Fanstream\n");
  for (std::size_t v = 0; v < positions.size(); ++v) {
    const glm::dvec3& p = positions[v];
    fmt::format_to(out, "v {} {} {}", p.x, p.y, p.z);
    if (!attributes.colors.empty()) {
      const glm::vec4& c = attributes.colors[v];
      fmt::format_to(out, " {:.6g} {:.6g} {:.6g}", srgb_of_linear(c.r), srgb_of_linear(c.g), srgb_of_linear(c.b));
    }
    bytes.push_back('\n');
  }
  for (const glm::dvec2& uv : attributes.texture_coordinates) {
    fmt::format_to(out, "vt {} {}\n", upward(uv).x, upward(uv).y);
  }
  for (const Triangle& t : triangles) {
    bytes.push_back('f');
    for (const VertexId v : t) {
      fmt::format_to(out, " {}", std::uint64_t{v} + 1);
      if (!attributes.texture_coordinates.empty()) fmt::format_to(out, "/{}", std::uint64_t{v} + 1);
    }
    bytes.push_back('\n');
  }
  return bytes;
}

// The binary part of a glb, list after list, and what the JSON says of it.
class GlbData {
 public:
  static constexpr int kFloat = 5126, kUnsignedInt = 5125, kUnsignedShort = 5123;
  static constexpr int kVertexBuffer = 34962, kIndexBuffer = 34963;

  // `count` elements, all bytes of which are in `bytes` already; multiples of four, so that all lists are aligned.
  // Returns the accessor's number.
  int add(Bytes bytes, int component_type, const char* type, std::size_t count, int target) {
    views_.push_back({{"buffer", 0}, {"byteOffset", data_.size()}, {"byteLength", bytes.size()}, {"target", target}});
    accessors_.push_back(
        {{"bufferView", views_.size() - 1}, {"componentType", component_type}, {"count", count}, {"type", type}});
    data_.insert(data_.end(), bytes.begin(), bytes.end());
    return static_cast<int>(accessors_.size()) - 1;
  }
  nlohmann::json& accessor(int index) { return accessors_[static_cast<std::size_t>(index)]; }
  const Bytes& data() const { return data_; }
  std::string json(const nlohmann::json& attributes, int indices) const {
    const nlohmann::json primitive = {{"attributes", attributes}, {"indices", indices}, {"mode", 4}};
    const nlohmann::json json = {
        {"asset", {{"version", "2.0"}, {"generator", "Fanstream"}}},
        {"scene", 0},
        {"scenes", {{{"nodes", {0}}}}},
        {"nodes", {{{"mesh", 0}}}},
        {"meshes", nlohmann::json::array({{{"primitives", nlohmann::json::array({primitive})}}})},
        {"accessors", accessors_},
        {"bufferViews", views_},
        {"buffers", {{{"byteLength", data_.size()}}}}};
    return json.dump();
  }

 private:
  Bytes data_;
  nlohmann::json views_ = nlohmann::json::array(), accessors_ = nlohmann::json::array();
};

int add_points(GlbData& glb, std::span<const glm::dvec3> positions) {
  Bytes bytes;
  glm::vec3 low(positions[0]);
  glm::vec3 high = low;
  for (const glm::dvec3& position : positions) {
    const glm::vec3 p(position);
    low = glm::min(low, p);
    high = glm::max(high, p);
    append(bytes, p);
  }
  const int points = glb.add(std::move(bytes), GlbData::kFloat, "VEC3", positions.size(), GlbData::kVertexBuffer);
  glb.accessor(points)["min"] = {low.x, low.y, low.z};
  glb.accessor(points)["max"] = {high.x, high.y, high.z};
  return points;
}

int add_texture_coordinates(GlbData& glb, std::span<const glm::dvec2> coordinates) {
  Bytes bytes;
  for (const glm::dvec2& uv : coordinates) append(bytes, glm::vec2(uv));
  return glb.add(std::move(bytes), GlbData::kFloat, "VEC2", coordinates.size(), GlbData::kVertexBuffer);
}

// Sixteen bits: eight would show steps in dark colours, since they are linear.
int add_colors(GlbData& glb, std::span<const glm::vec4> colors) {
  Bytes bytes;
  for (const glm::vec4& color : colors) {
    for (int c = 0; c < 4; ++c) {
      append(bytes, static_cast<std::uint16_t>(std::lround(std::clamp(color[c], 0.0F, 1.0F) * 65535.0F)));
    }
  }
  const int index = glb.add(std::move(bytes), GlbData::kUnsignedShort, "VEC4", colors.size(), GlbData::kVertexBuffer);
  glb.accessor(index)["normalized"] = true;
  return index;
}

// glTF 2.0, section 4.4: a header and two chunks, lengths in bytes, each chunk padded to four.
Result<Bytes> encode_glb(std::span<const glm::dvec3> positions, std::span<const Triangle> triangles,
                         const VertexAttributes& attributes) {
  const std::size_t vertex_bytes =
      12 + (attributes.texture_coordinates.empty() ? 0 : 8) + (attributes.colors.empty() ? 0 : 8);
  const std::size_t data_bytes = positions.size() * vertex_bytes + triangles.size_bytes();
  constexpr std::size_t kLargest = 0xFFFFFFFFU, kRoomForJson = 4096;
  if (data_bytes > kLargest - kRoomForJson) {
    return fail(ErrorKind::limit, fmt::format("{} bytes are more than a .glb can hold (4 GB); write .ply", data_bytes));
  }
  GlbData glb;
  nlohmann::json named = {{"POSITION", add_points(glb, positions)}};
  if (!attributes.texture_coordinates.empty()) {
    named["TEXCOORD_0"] = add_texture_coordinates(glb, attributes.texture_coordinates);
  }
  if (!attributes.colors.empty()) named["COLOR_0"] = add_colors(glb, attributes.colors);
  Bytes corners;
  corners.reserve(triangles.size_bytes());
  for (const Triangle& triangle : triangles) append(corners, triangle);
  const int indices =
      glb.add(std::move(corners), GlbData::kUnsignedInt, "SCALAR", 3 * triangles.size(), GlbData::kIndexBuffer);
  std::string json = glb.json(named, indices);
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const auto word = [](std::size_t n) { return static_cast<std::uint32_t>(n); };
  const std::size_t total_bytes = 12 + 8 + json.size() + 8 + glb.data().size();
  Bytes bytes;
  bytes.reserve(total_bytes);
  for (const std::uint32_t n : {0x46546C67U, 2U, word(total_bytes)}) append(bytes, n);  // "glTF", version, length
  for (const std::uint32_t n : {word(json.size()), 0x4E4F534AU}) append(bytes, n);      // "JSON"
  append_text(bytes, json);
  for (const std::uint32_t n : {word(glb.data().size()), 0x004E4942U}) append(bytes, n);  // "BIN"
  bytes.insert(bytes.end(), glb.data().begin(), glb.data().end());
  return bytes;
}

}  // namespace

Result<MeshFileFormat> mesh_file_format(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (extension == ".ply") return MeshFileFormat::ply;
  if (extension == ".obj") return MeshFileFormat::obj;
  if (extension == ".glb") return MeshFileFormat::glb;
  return fail(ErrorKind::usage,
              fmt::format("{}: cannot tell the format; end the name in .ply, .obj or .glb", path.string()));
}

Result<std::vector<std::uint8_t>> encode_mesh(std::span<const glm::dvec3> positions,
                                              std::span<const Triangle> triangles, MeshFileFormat format,
                                              const VertexAttributes& attributes) {
  if (auto checked = check_mesh(positions, triangles, format); !checked) return tl::unexpected(checked.error());
  for (const std::size_t count : {attributes.texture_coordinates.size(), attributes.colors.size()}) {
    if (count == 0 || count == positions.size()) continue;
    return fail(ErrorKind::bad_input, fmt::format("{} attributes for {} vertices", count, positions.size()));
  }
  switch (format) {
    case MeshFileFormat::ply: return encode_ply(positions, triangles, attributes);
    case MeshFileFormat::obj: return encode_obj(positions, triangles, attributes);
    case MeshFileFormat::glb: break;
  }
  return encode_glb(positions, triangles, attributes);
}

Result<void> export_mesh(const std::filesystem::path& path, std::span<const glm::dvec3> positions,
                         std::span<const Triangle> triangles, const VertexAttributes& attributes) {
  const auto format = mesh_file_format(path);
  if (!format) return tl::unexpected(format.error());
  const auto bytes = encode_mesh(positions, triangles, *format, attributes);
  if (!bytes) return tl::unexpected(with_context(bytes.error(), path.string()));
  return write_file_atomically(path, *bytes);
}

}  // namespace fanstream
