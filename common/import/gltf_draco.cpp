#include "common/import/gltf_draco.h"

#include <draco/compression/decode.h>
#include <draco/core/varint_decoding.h>
#include <draco/mesh/mesh.h>
#include <draco/metadata/metadata_decoder.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace fanstream {
namespace {

// Draco takes memory for as many faces as the data claims. Its best rate on real meshes is some ten faces per byte,
// positions included, so what claims far more is hostile.
constexpr std::uint64_t kMaxFacesPerByte = 64;
constexpr std::size_t kHeaderBytes = 11;
constexpr std::uint16_t kMetadataFlag = 0x8000;
constexpr std::uint8_t kEdgebreakerMethod = 1;

// The number of faces the data claims, from where the bitstream holds it (version 2.2, the only one glTF allows), or
// nothing if there is none to be found.
bool read_claimed_faces(std::string_view bytes, std::uint64_t& faces) {
  if (bytes.size() < kHeaderBytes || !bytes.starts_with("DRACO") || bytes[5] != 2 || bytes[6] != 2) return false;
  const auto method = static_cast<std::uint8_t>(bytes[8]);
  const std::uint16_t flags =
      static_cast<std::uint8_t>(bytes[9]) | static_cast<std::uint16_t>(static_cast<std::uint8_t>(bytes[10])) << 8;
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  buffer.set_bitstream_version(DRACO_BITSTREAM_VERSION(2, 2));
  buffer.Advance(kHeaderBytes);
  if ((flags & kMetadataFlag) != 0) {
    draco::GeometryMetadata metadata;
    if (!draco::MetadataDecoder().DecodeGeometryMetadata(&buffer, &metadata)) return false;
  }
  std::uint32_t count = 0;
  if (method == kEdgebreakerMethod) {
    std::uint8_t traversal = 0;
    if (!buffer.Decode(&traversal) || !draco::DecodeVarint(&count, &buffer)) return false;  // vertices come first
  }
  if (!draco::DecodeVarint(&count, &buffer)) return false;
  faces = count;
  return true;
}

// Up to four components of every point; those that are missing are 1. False where a point has no value.
bool read_values(const draco::Mesh& source, const DracoAttribute& wanted, std::vector<std::array<float, 4>>& values) {
  const draco::PointAttribute* attribute = source.GetAttributeByUniqueId(wanted.id);
  if (attribute == nullptr || attribute->num_components() < 2 || attribute->num_components() > 4) return false;
  float scale = 1.0F;  // Draco scales what it has been told is normalised
  if (wanted.normalized && !attribute->normalized()) {
    switch (attribute->data_type()) {
      case draco::DT_INT8: scale = 1.0F / 127.0F; break;
      case draco::DT_UINT8: scale = 1.0F / 255.0F; break;
      case draco::DT_INT16: scale = 1.0F / 32767.0F; break;
      case draco::DT_UINT16: scale = 1.0F / 65535.0F; break;
      default: break;
    }
  }
  values.reserve(source.num_points());
  for (draco::PointIndex point(0); point < source.num_points(); ++point) {
    std::array<float, 4> value{};
    const draco::AttributeValueIndex index = attribute->mapped_index(point);
    if (index.value() >= attribute->size() ||
        !attribute->ConvertValue<float>(index, attribute->num_components(), value.data())) {
      return false;
    }
    for (std::size_t c = 0; c < 4; ++c) {
      value[c] = c < static_cast<std::size_t>(attribute->num_components()) ? scale * value[c] : 1.0F;
    }
    values.push_back(value);
  }
  return true;
}

}  // namespace

Result<DracoPrimitive> decode_draco_primitive(const InputFile& file, std::string_view bytes,
                                              const DracoAttributes& attributes, std::string_view what,
                                              const ImportOptions& options) {
  const auto refuse = [&](std::string_view why) {
    return fail_in(file, ErrorKind::bad_input, fmt::format("{}: its Draco data {}", what, why));
  };
  std::uint64_t claimed_faces = 0;
  if (!read_claimed_faces(bytes, claimed_faces)) return refuse("has no valid header of version 2.2: it is damaged");
  if (claimed_faces > options.max_triangles || claimed_faces > kMaxFacesPerByte * bytes.size()) {
    return refuse(fmt::format("claims {} faces in {} bytes: it is damaged", claimed_faces, bytes.size()));
  }
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok()) return refuse(fmt::format("cannot be decoded: {}", decoded.status().error_msg_string()));
  const draco::Mesh& source = *decoded.value();
  const draco::PointAttribute* attribute = source.GetAttributeByUniqueId(attributes.position_id);
  if (attribute == nullptr || attribute->num_components() != 3) {
    return refuse(fmt::format("has no attribute {} of three components", attributes.position_id));
  }
  DracoPrimitive primitive;
  TriangleMesh& mesh = primitive.mesh;
  mesh.positions.resize(source.num_points());
  for (draco::PointIndex point(0); point < source.num_points(); ++point) {
    const draco::AttributeValueIndex value = attribute->mapped_index(point);
    if (value.value() >= attribute->size() ||
        !attribute->ConvertValue<double, 3>(value, &mesh.positions[point.value()][0])) {
      return refuse(fmt::format("has no position for point {}", point.value()));
    }
  }
  mesh.triangles.reserve(source.num_faces());
  for (draco::FaceIndex face(0); face < source.num_faces(); ++face) {
    const draco::Mesh::Face& corners = source.face(face);
    const Triangle triangle{corners[0].value(), corners[1].value(), corners[2].value()};
    if (std::any_of(triangle.begin(), triangle.end(), [&](VertexId v) { return v >= mesh.positions.size(); })) {
      return refuse(fmt::format("has a face {} beyond its points", face.value()));
    }
    mesh.triangles.push_back(triangle);
  }
  std::vector<std::array<float, 4>> values;
  if (attributes.texture_coordinates) {
    if (!read_values(source, *attributes.texture_coordinates, values)) return refuse("lacks texture coordinates");
    for (const auto& v : values) primitive.attributes.texture_coordinates.emplace_back(v[0], v[1]);
    values.clear();
  }
  if (attributes.colors) {
    if (!read_values(source, *attributes.colors, values)) return refuse("lacks colours");
    for (const auto& v : values) primitive.attributes.colors.emplace_back(v[0], v[1], v[2], v[3]);
  }
  return primitive;
}

}  // namespace fanstream
