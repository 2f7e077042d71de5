#include "tests/bench/draco_peer.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "tests/bench/thread_clock.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wunused-parameter"
#include <draco/compression/decode.h>
#include <draco/compression/encode.h>
#include <draco/mesh/mesh.h>
#pragma GCC diagnostic pop

namespace fanstream::bench {

namespace {

void fill(const GridMesh& mesh, draco::Mesh& result) {
  result.set_num_points(static_cast<std::uint32_t>(mesh.positions.size()));
  draco::GeometryAttribute description;
  description.Init(draco::GeometryAttribute::POSITION, nullptr, 3, draco::DT_INT32, false, 3 * sizeof(std::int32_t), 0);
  // Identity mapping and no deduplication: vertices that share a grid point stay apart.
  const int id = result.AddAttribute(description, true, static_cast<std::uint32_t>(mesh.positions.size()));
  draco::PointAttribute* positions = result.attribute(id);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    positions->SetAttributeValue(draco::AttributeValueIndex(static_cast<std::uint32_t>(v)), mesh.positions[v].data());
  }
  result.SetNumFaces(mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    result.SetFace(draco::FaceIndex(static_cast<std::uint32_t>(i)),
                   {draco::PointIndex(t[0]), draco::PointIndex(t[1]), draco::PointIndex(t[2])});
  }
}

// Decodes once into `seconds`; an error if triangles or vertices are missing.
Result<void> decode(const draco::EncoderBuffer& bytes, const GridMesh& mesh, double& seconds) {
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  draco::Decoder decoder;
  const double start = thread_cpu_seconds();
  const auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  seconds = thread_cpu_seconds() - start;
  if (!decoded.ok()) return fail(ErrorKind::bad_input, "Draco cannot decode: " + decoded.status().error_msg_string());
  const std::size_t triangles = decoded.value()->num_faces();
  const std::size_t points = decoded.value()->num_points();
  if (triangles != mesh.triangles.size()) {
    return fail(ErrorKind::bad_input, "Draco gave back " + std::to_string(triangles) + " of " +
                                          std::to_string(mesh.triangles.size()) + " triangles");
  }
  if (points < mesh.positions.size()) {
    return fail(ErrorKind::bad_input, "Draco gave back " + std::to_string(points) + " of " +
                                          std::to_string(mesh.positions.size()) + " vertices");
  }
  return {};
}

Result<void> check(const GridMesh& mesh, int level, int decode_repetitions) {
  if (level < 0 || level > 10) return fail(ErrorKind::usage, "Draco's compression level must be 0 to 10");
  if (decode_repetitions < 1) return fail(ErrorKind::usage, "decode repetitions must be 1 or more");
  if (mesh.triangles.empty()) return fail(ErrorKind::bad_input, "the mesh has no triangles");
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (const VertexId v : mesh.triangles[i]) {
      if (v < mesh.positions.size()) continue;
      return fail(ErrorKind::bad_input, "triangle " + std::to_string(i) + " names vertex " + std::to_string(v) +
                                            " of " + std::to_string(mesh.positions.size()));
    }
  }
  return {};
}

}  // namespace

GridMesh on_grid(const TriangleMesh& mesh, unsigned bits) {
  const Bounds bounds = bounds_of(mesh.positions);
  const glm::dvec3 extent = bounds.high - bounds.low;
  const double longest = std::max({extent.x, extent.y, extent.z});
  const double steps_per_unit = longest > 0.0 ? std::ldexp(1.0, static_cast<int>(bits)) - 1.0 : 0.0;
  GridMesh result;
  result.triangles = mesh.triangles;
  result.positions.reserve(mesh.positions.size());
  for (const glm::dvec3& p : mesh.positions) {
    std::array<std::int32_t, 3> q{};
    for (int axis = 0; axis < 3; ++axis) {
      const double part = longest > 0.0 ? (p[axis] - bounds.low[axis]) / longest : 0.0;
      q[static_cast<std::size_t>(axis)] = static_cast<std::int32_t>(std::floor(part * steps_per_unit + 0.5));
    }
    result.positions.push_back(q);
  }
  return result;
}

Result<DracoResult> measure_draco(const GridMesh& mesh, int level, int decode_repetitions) {
  if (const Result<void> valid = check(mesh, level, decode_repetitions); !valid) {
    return tl::unexpected<Error>(valid.error());
  }
  draco::Mesh input;
  fill(mesh, input);
  draco::Encoder encoder;
  encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
  encoder.SetSpeedOptions(10 - level, 10 - level);
  draco::EncoderBuffer bytes;
  DracoResult result;
  const double start = thread_cpu_seconds();
  const draco::Status status = encoder.EncodeMeshToBuffer(input, &bytes);
  result.encode_seconds = thread_cpu_seconds() - start;
  if (!status.ok()) return fail(ErrorKind::bad_input, "Draco cannot encode: " + status.error_msg_string());

  std::vector<double> seconds(static_cast<std::size_t>(decode_repetitions));
  for (double& s : seconds) {
    if (const Result<void> decoded = decode(bytes, mesh, s); !decoded) return tl::unexpected<Error>(decoded.error());
  }
  const auto middle = seconds.begin() + decode_repetitions / 2;
  std::nth_element(seconds.begin(), middle, seconds.end());
  result.decode_seconds = *middle;
  result.decode_mtriangles_s = static_cast<double>(mesh.triangles.size()) / *middle * 1e-6;
  result.size_bytes = bytes.size();
  result.bits_per_vertex = 8.0 * static_cast<double>(bytes.size()) / static_cast<double>(mesh.positions.size());
  return result;
}

}  // namespace fanstream::bench
