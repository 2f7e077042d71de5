#include "client/export/mesh_export.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <type_traits>

#include "common/support/atomic_file.h"

namespace fanstream {
namespace {

static_assert(std::endian::native == std::endian::little, "the writers copy numbers as they lie in memory");

using Bytes = std::vector<std::uint8_t>;

template <class T>
void append(Bytes& bytes, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  const auto* begin = reinterpret_cast<const std::uint8_t*>(&value);
  bytes.insert(bytes.end(), begin, begin + sizeof value);
}

void append_text(Bytes& bytes, std::string_view text) { bytes.insert(bytes.end(), text.begin(), text.end()); }

// Whether x is finite and at most the largest float.
bool in_float_range(double x) { return std::abs(x) <= static_cast<double>(std::numeric_limits<float>::max()); }

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

bool exactly_floats(std::span<const glm::dvec3> positions) {
  return std::all_of(positions.begin(), positions.end(), [](const glm::dvec3& p) {
    return in_float_range(p.x) && in_float_range(p.y) && in_float_range(p.z) && glm::dvec3(glm::vec3(p)) == p;
  });
}

Bytes encode_ply(std::span<const glm::dvec3> positions, std::span<const Triangle> triangles) {
  const bool floats = exactly_floats(positions);
  const std::string type = floats ? "float" : "double";
  Bytes bytes;
  bytes.reserve(256 + positions.size() * (floats ? 12 : 24) + triangles.size() * 13);
  append_text(bytes, "ply\nformat binary_little_endian 1.0\ncomment Fanstream\n");
  append_text(bytes,
              fmt::format("element vertex {0}\nproperty {1} x\nproperty {1} y\nproperty {1} z\nelement face {2}\n"
                          "property list uchar int vertex_indices\nend_header\n",
                          positions.size(), type, triangles.size()));
  for (const glm::dvec3& position : positions) {
    if (floats) {
      append(bytes, glm::vec3(position));
    } else {
      append(bytes, position);
    }
  }
  for (const Triangle& triangle : triangles) {
    append(bytes, std::uint8_t{3});
    append(bytes, triangle);
  }
  return bytes;
}

Bytes encode_obj(std::span<const glm::dvec3> positions, std::span<const Triangle> triangles) {
  Bytes bytes;
  const auto out = std::back_inserter(bytes);
  append_text(bytes, "# Fanstream\n");
  for (const glm::dvec3& p : positions) fmt::format_to(out, "v {} {} {}\n", p.x, p.y, p.z);
  for (const Triangle& t : triangles) {
    fmt::format_to(out, "f {} {} {}\n", std::uint64_t{t[0]} + 1, std::uint64_t{t[1]} + 1, std::uint64_t{t[2]} + 1);
  }
  return bytes;
}

std::string gltf_json(std::span<const glm::vec3> points, std::size_t triangle_count) {
  glm::vec3 low = points[0];
  glm::vec3 high = points[0];
  for (const glm::vec3& p : points) {
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], p[axis]);
      high[axis] = std::max(high[axis], p[axis]);
    }
  }
  constexpr int kFloat = 5126;
  constexpr int kUnsignedInt = 5125;
  const std::size_t points_bytes = points.size_bytes();
  const std::size_t indices_bytes = triangle_count * sizeof(Triangle);
  const nlohmann::json json = {
      {"asset", {{"version", "2.0"}, {"generator", "Fanstream"}}},
      {"scene", 0},
      {"scenes", {{{"nodes", {0}}}}},
      {"nodes", {{{"mesh", 0}}}},
      {"meshes", {{{"primitives", {{{"attributes", {{"POSITION", 0}}}, {"indices", 1}, {"mode", 4}}}}}}},
      {"accessors",
       {{{"bufferView", 0},
         {"componentType", kFloat},
         {"count", points.size()},
         {"type", "VEC3"},
         {"min", {low.x, low.y, low.z}},
         {"max", {high.x, high.y, high.z}}},
        {{"bufferView", 1}, {"componentType", kUnsignedInt}, {"count", 3 * triangle_count}, {"type", "SCALAR"}}}},
      {"bufferViews",
       {{{"buffer", 0}, {"byteOffset", 0}, {"byteLength", points_bytes}, {"target", 34962}},
        {{"buffer", 0}, {"byteOffset", points_bytes}, {"byteLength", indices_bytes}, {"target", 34963}}}},
      {"buffers", {{{"byteLength", points_bytes + indices_bytes}}}}};
  return json.dump();
}

// glTF 2.0, section 4.4: a header and two chunks, lengths in bytes, each chunk padded to four.
Result<Bytes> encode_glb(std::span<const glm::dvec3> positions, std::span<const Triangle> triangles) {
  const std::vector<glm::vec3> points(positions.begin(), positions.end());
  std::string json = gltf_json(points, triangles.size());
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const std::size_t data_bytes = points.size() * sizeof(glm::vec3) + triangles.size_bytes();
  const std::size_t total_bytes = 12 + 8 + json.size() + 8 + data_bytes;
  if (total_bytes > 0xFFFFFFFFU) {
    return fail(ErrorKind::limit,
                fmt::format("{} bytes are more than a .glb can hold (4 GB); write .ply", total_bytes));
  }
  const auto word = [](std::size_t n) { return static_cast<std::uint32_t>(n); };
  Bytes bytes;
  bytes.reserve(total_bytes);
  for (const std::uint32_t n : {0x46546C67U, 2U, word(total_bytes)}) append(bytes, n);  // "glTF", version, length
  for (const std::uint32_t n : {word(json.size()), 0x4E4F534AU}) append(bytes, n);      // "JSON"
  append_text(bytes, json);
  for (const std::uint32_t n : {word(data_bytes), 0x004E4942U}) append(bytes, n);  // "BIN"
  for (const glm::vec3& point : points) append(bytes, point);
  for (const Triangle& triangle : triangles) append(bytes, triangle);
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

Result<Bytes> encode_mesh(std::span<const glm::dvec3> positions, std::span<const Triangle> triangles,
                          MeshFileFormat format) {
  if (auto checked = check_mesh(positions, triangles, format); !checked) return tl::unexpected(checked.error());
  switch (format) {
    case MeshFileFormat::ply: return encode_ply(positions, triangles);
    case MeshFileFormat::obj: return encode_obj(positions, triangles);
    case MeshFileFormat::glb: break;
  }
  return encode_glb(positions, triangles);
}

Result<void> export_mesh(const std::filesystem::path& path, std::span<const glm::dvec3> positions,
                         std::span<const Triangle> triangles) {
  const auto format = mesh_file_format(path);
  if (!format) return tl::unexpected(format.error());
  const auto bytes = encode_mesh(positions, triangles, *format);
  if (!bytes) return tl::unexpected(with_context(bytes.error(), path.string()));
  return write_file_atomically(path, *bytes);
}

}  // namespace fanstream
