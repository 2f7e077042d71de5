#include "client/session/draco_peer.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <string>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wunused-parameter"
#include <draco/compression/decode.h>
#include <draco/compression/encode.h>
#include <draco/mesh/mesh.h>
#pragma GCC diagnostic pop

namespace fanstream {
namespace {

double thread_cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

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

Result<GridMesh> grid_mesh(const TriangleMesh& mesh, double step_size) {
  const glm::dvec3 corner = bounds_of(mesh.positions).low;
  GridMesh result;
  result.triangles = mesh.triangles;
  result.positions.reserve(mesh.positions.size());
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    std::array<std::int32_t, 3>& place = result.positions.emplace_back();
    for (int axis = 0; axis < 3; ++axis) {
      const double steps = (mesh.positions[v][axis] - corner[axis]) / step_size;
      if (!(steps < 0x1p30)) return fail(ErrorKind::limit, "Draco: the model is too large for its grid step");
      if (std::abs(steps - std::round(steps)) > 0.1) {
        return fail(ErrorKind::bad_input, "Draco: vertex " + std::to_string(v) + " is not on the grid");
      }
      place[static_cast<std::size_t>(axis)] = static_cast<std::int32_t>(std::lround(steps));
    }
  }
  return result;
}

Result<DracoFile> make_draco_file(const GridMesh& mesh, int level, int decode_repetitions) {
  if (const Result<void> valid = check(mesh, level, decode_repetitions); !valid) return tl::unexpected(valid.error());
  draco::Mesh input;
  fill(mesh, input);
  draco::Encoder encoder;
  encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
  encoder.SetSpeedOptions(10 - level, 10 - level);
  draco::EncoderBuffer encoded;
  DracoFile file;
  const double start = thread_cpu_seconds();
  const draco::Status status = encoder.EncodeMeshToBuffer(input, &encoded);
  file.encode_seconds = thread_cpu_seconds() - start;
  if (!status.ok()) return fail(ErrorKind::bad_input, "Draco cannot encode: " + status.error_msg_string());

  const auto* begin = reinterpret_cast<const std::byte*>(encoded.data());
  file.bytes.assign(begin, begin + encoded.size());
  std::vector<double> seconds(static_cast<std::size_t>(decode_repetitions));
  for (double& s : seconds) {
    const Result<double> decoded = decode_draco_file(file, mesh);
    if (!decoded) return tl::unexpected(decoded.error());
    s = *decoded;
  }
  const auto middle = seconds.begin() + decode_repetitions / 2;
  std::nth_element(seconds.begin(), middle, seconds.end());
  file.decode_seconds = *middle;
  return file;
}

Result<double> decode_draco_file(const DracoFile& file, const GridMesh& mesh) {
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(file.bytes.data()), file.bytes.size());
  draco::Decoder decoder;
  const double start = thread_cpu_seconds();
  const auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  const double seconds = thread_cpu_seconds() - start;
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
  return seconds;
}

PeerDownload download_of(const DracoFile& file, const VirtualLinkOptions& link) {
  return {file.bytes.size(), download_s(link, file.bytes.size()), file.decode_seconds};
}

}  // namespace fanstream
