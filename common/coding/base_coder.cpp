#include "common/coding/base_coder.h"

#include <draco/compression/decode.h>
#include <draco/compression/expert_encode.h>

#include "common/mesh/manifold_check.h"

namespace fanstream {

Result<std::vector<std::byte>> encode_base(const BaseMesh& base) {
  draco::Mesh mesh;
  const auto vertices = static_cast<std::uint32_t>(base.places.size());
  mesh.set_num_points(vertices);
  draco::GeometryAttribute position;
  position.Init(draco::GeometryAttribute::POSITION, nullptr, 3, draco::DT_INT32, false, 3 * sizeof(std::int32_t), 0);
  const int attribute = mesh.AddAttribute(position, true, vertices);
  for (std::uint32_t v = 0; v < vertices; ++v) {
    mesh.attribute(attribute)->SetAttributeValue(draco::AttributeValueIndex(v), &base.places[v]);
  }
  mesh.SetNumFaces(base.triangles.size());
  for (std::uint32_t f = 0; f < base.triangles.size(); ++f) {
    draco::Mesh::Face face;
    for (std::size_t c = 0; c < 3; ++c) face[c] = draco::PointIndex(base.triangles[f][c]);
    mesh.SetFace(draco::FaceIndex(f), face);
  }
  draco::ExpertEncoder encoder(mesh);
  encoder.SetSpeedOptions(0, 0);
  encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
  draco::EncoderBuffer buffer;
  if (const draco::Status status = encoder.EncodeToBuffer(&buffer); !status.ok()) {
    return fail(ErrorKind::bad_input, "Draco cannot encode the base mesh: " + status.error_msg_string());
  }
  const auto* data = reinterpret_cast<const std::byte*>(buffer.data());
  return std::vector<std::byte>(data, data + buffer.size());
}

Result<BaseMesh> decode_base(std::span<const std::byte> bytes, std::uint32_t most_vertices) {
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok()) return fail(ErrorKind::bad_input, "Draco: " + decoded.status().error_msg_string());
  const draco::Mesh& mesh = *decoded.value();
  const draco::PointAttribute* position = mesh.GetNamedAttribute(draco::GeometryAttribute::POSITION);
  if (position == nullptr || position->data_type() != draco::DT_INT32 || position->num_components() != 3) {
    return fail(ErrorKind::bad_input, "Draco data without integer positions");
  }
  if (mesh.num_points() > most_vertices) return fail(ErrorKind::limit, "more vertices than the whole model");
  BaseMesh base;
  base.places.resize(mesh.num_points());
  for (std::uint32_t v = 0; v < mesh.num_points(); ++v) {
    const draco::AttributeValueIndex value = position->mapped_index(draco::PointIndex(v));
    if (value.value() >= position->size()) return fail(ErrorKind::bad_input, "a vertex has no position");
    position->GetValue(value, &base.places[v]);
  }
  base.triangles.resize(mesh.num_faces());
  for (std::uint32_t f = 0; f < mesh.num_faces(); ++f) {
    const draco::Mesh::Face& face = mesh.face(draco::FaceIndex(f));
    base.triangles[f] = {face[0].value(), face[1].value(), face[2].value()};
  }
  TriangleMesh topology;
  topology.positions.resize(base.places.size());
  topology.triangles = base.triangles;
  std::string why;
  if (!is_oriented_manifold(topology, &why)) return fail(ErrorKind::bad_input, "not a manifold mesh: " + why);
  return base;
}

}  // namespace fanstream
