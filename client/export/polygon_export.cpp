#include "client/export/polygon_export.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "client/export/file_bytes.h"
#include "common/support/atomic_file.h"

namespace fanstream {
namespace {

using namespace detail;

Result<void> check_mesh(const PolygonMesh& mesh, const std::vector<glm::dvec3>& places) {
  if (mesh.face_count() == 0) return fail(ErrorKind::usage, "the mesh has no faces to write");
  for (std::size_t v = 0; v < places.size(); ++v) {
    const glm::dvec3& p = places[v];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
      return fail(ErrorKind::bad_input, fmt::format("vertex {} is not at a finite place", v));
    }
  }
  for (FaceId f = 0; f < mesh.face_count(); ++f) {
    for (const VertexId v : mesh.face(f)) {
      if (v >= places.size()) {
        return fail(ErrorKind::bad_input, fmt::format("face {} names vertex {} of {}", f, v, places.size()));
      }
    }
  }
  return {};
}

Bytes encode_ply(const PolygonMesh& mesh, const std::vector<glm::dvec3>& places) {
  std::size_t largest = 0;
  for (FaceId f = 0; f < mesh.face_count(); ++f) largest = std::max(largest, mesh.face(f).size());
  const bool floats = exactly_floats(places);
  const bool small = largest <= 255;
  const std::string header = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment Fanstream\nelement vertex {0}\nproperty {1} x\nproperty {1} y\n"
      "property {1} z\nelement face {2}\nproperty list {3} int vertex_indices\nend_header\n",
      places.size(), floats ? "float" : "double", mesh.face_count(), small ? "uchar" : "uint");
  Bytes bytes;
  bytes.reserve(header.size() + places.size() * (floats ? 12 : 24) + mesh.face_count() * (small ? 1 : 4) +
                mesh.corners.size() * 4);
  append_text(bytes, header);
  for (const glm::dvec3& place : places) {
    append_place(bytes, place, floats);
  }
  for (FaceId f = 0; f < mesh.face_count(); ++f) {
    if (small) {
      append(bytes, static_cast<std::uint8_t>(mesh.face(f).size()));
    } else {
      append(bytes, static_cast<std::uint32_t>(mesh.face(f).size()));
    }
    for (const VertexId v : mesh.face(f)) append(bytes, v);
  }
  return bytes;
}

Bytes encode_obj(const PolygonMesh& mesh, const std::vector<glm::dvec3>& places) {
  const bool weighted =
      std::any_of(mesh.points.begin(), mesh.points.end(), [](const glm::dvec4& p) { return p.w != 1.0; });
  Bytes bytes;
  const auto out = std::back_inserter(bytes);
  fmt::format_to(out, "# Fanstream\n");
  for (std::size_t v = 0; v < places.size(); ++v) {
    fmt::format_to(out, "v {} {} {}", places[v].x, places[v].y, places[v].z);
    if (weighted) fmt::format_to(out, " {}", mesh.points[v].w);
    bytes.push_back('\n');
  }
  for (FaceId f = 0; f < mesh.face_count(); ++f) {
    bytes.push_back('f');
    for (const VertexId v : mesh.face(f)) fmt::format_to(out, " {}", std::uint64_t{v} + 1);
    bytes.push_back('\n');
  }
  return bytes;
}

}  // namespace

Result<std::vector<std::uint8_t>> encode_polygons(const PolygonMesh& mesh, MeshFileFormat format) {
  if (format == MeshFileFormat::glb) {
    const TriangleMesh triangles = triangle_mesh(mesh);
    return encode_mesh(triangles.positions, triangles.triangles, format);
  }
  const std::vector<glm::dvec3> places = positions(mesh.points);
  if (auto checked = check_mesh(mesh, places); !checked) return tl::unexpected(checked.error());
  return format == MeshFileFormat::ply ? encode_ply(mesh, places) : encode_obj(mesh, places);
}

Result<void> export_polygons(const std::filesystem::path& path, const PolygonMesh& mesh) {
  const auto format = mesh_file_format(path);
  if (!format) return tl::unexpected(format.error());
  const auto bytes = encode_polygons(mesh, *format);
  if (!bytes) return tl::unexpected(with_context(bytes.error(), path.string()));
  return write_file_atomically(path, *bytes);
}

}  // namespace fanstream
