// PLY: Greg Turk's "The PLY Polygon File Format" (1994), with the type names of later writers.
#include <fmt/format.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "common/import/attribute_lists.h"
#include "common/import/mesh_assembly.h"
#include "common/import/ply_header.h"
#include "common/import/readers.h"
#include "common/import/text_scanner.h"

namespace fanstream {
namespace {

// The values of a binary body. Reading stops at the end of the file: the caller asks `has` first.
template <bool swap>
class BinaryValues {
 public:
  BinaryValues(const InputFile& file, std::size_t begin) : file_(file), at_(begin) {}

  static std::size_t min_value_bytes(PlyType type) { return size_bytes(type); }
  std::size_t remaining_bytes() const { return file_.bytes().size() - at_; }

  bool decimal(PlyType type, double& value) {
    switch (type) {
      case PlyType::float32: return read<float, std::uint32_t>(value);
      case PlyType::float64: return read<double, std::uint64_t>(value);
      default: break;
    }
    std::int64_t integral = 0;
    if (!integer(type, integral)) return false;
    value = static_cast<double>(integral);
    return true;
  }

  bool integer(PlyType type, std::int64_t& value) {
    switch (type) {
      case PlyType::int8: return read<std::int8_t, std::uint8_t>(value);
      case PlyType::uint8: return read<std::uint8_t, std::uint8_t>(value);
      case PlyType::int16: return read<std::int16_t, std::uint16_t>(value);
      case PlyType::uint16: return read<std::uint16_t, std::uint16_t>(value);
      case PlyType::int32: return read<std::int32_t, std::uint32_t>(value);
      case PlyType::uint32: return read<std::uint32_t, std::uint32_t>(value);
      default: return false;
    }
  }

  bool skip(PlyType type, std::uint64_t count) {
    const std::size_t size = size_bytes(type);
    if (count > remaining_bytes() / size) return false;
    at_ += count * size;
    return true;
  }

  tl::unexpected<Error> fail_here(std::string_view what) const { return fail_at_byte(file_, at_, what); }
  tl::unexpected<Error> fail_value(std::string_view what) const {
    return fail_here(fmt::format("{} is missing: the file ends here, it may be truncated", what));
  }
  void note_rest(std::vector<std::string>& warnings) const {
    if (remaining_bytes() > 0) {
      warnings.push_back(
          fmt::format("Byte {}: {} bytes behind the last element were ignored.", at_, remaining_bytes()));
    }
  }

 private:
  template <class Stored, class Bits, class Value>
  bool read(Value& value) {
    if (remaining_bytes() < sizeof(Bits)) return false;
    Bits bits;
    std::memcpy(&bits, file_.bytes().data() + at_, sizeof bits);
    if constexpr (swap && sizeof(Bits) == 2) bits = __builtin_bswap16(bits);
    if constexpr (swap && sizeof(Bits) == 4) bits = __builtin_bswap32(bits);
    if constexpr (swap && sizeof(Bits) == 8) bits = __builtin_bswap64(bits);
    value = static_cast<Value>(std::bit_cast<Stored>(bits));
    at_ += sizeof bits;
    return true;
  }

  const InputFile& file_;
  std::size_t at_;
};

// The values of a text body, whatever lines they stand on.
class TextValues {
 public:
  TextValues(const InputFile& file, std::size_t begin) : scanner_(file, file.bytes().substr(begin)) {}

  static std::size_t min_value_bytes(PlyType) { return 2; }                       // a digit and a separator
  std::size_t remaining_bytes() const { return scanner_.remaining_bytes() + 1; }  // the last separator may be missing

  bool decimal(PlyType, double& value) { return parse(value); }
  bool integer(PlyType, std::int64_t& value) { return parse(value); }
  bool skip(PlyType, std::uint64_t count) {
    double ignored = 0;
    for (std::uint64_t i = 0; i < count; ++i) {
      if (!parse(ignored)) return false;
    }
    return true;
  }

  tl::unexpected<Error> fail_here(std::string_view what) const { return scanner_.fail_here(what); }
  tl::unexpected<Error> fail_value(std::string_view what) const { return scanner_.fail_number(fault_, what); }
  void note_rest(std::vector<std::string>& warnings) {
    if (scanner_.remaining_bytes() == 0) {
      warnings.emplace_back("The text ends within a line: the file may be truncated.");
    }
    scanner_.skip_space();
    if (scanner_.at_end()) return;
    warnings.push_back(
        fmt::format("Line {}: what follows the last element was ignored.", scanner_.line_at(scanner_.place())));
  }

 private:
  template <class Value>
  bool parse(Value& value) {
    scanner_.skip_space();
    fault_ = scanner_.number(value);
    return fault_ == TextScanner::Number::ok;
  }

  TextScanner scanner_;
  TextScanner::Number fault_ = TextScanner::Number::ok;
};

template <class Values>
class BodyReader {
 public:
  BodyReader(const PlyHeader& header, const ImportOptions& options, Values values)
      : header_(header), options_(options), values_(std::move(values)) {}

  Result<ImportedMesh> run(const InputFile& file) {
    for (const PlyElement& element : header_.elements) {
      if (element.name == "vertex") vertex_count_ = element.count;
    }
    if (vertex_count_ > options_.max_vertices) {
      return fail_in(file, ErrorKind::limit,
                     fmt::format("{} vertices, more than the limit of {}", vertex_count_, options_.max_vertices));
    }
    for (const PlyElement& element : header_.elements) {
      Result<void> done = check_size(element);
      if (done) done = read_element(element);
      if (!done) return tl::unexpected(done.error());
      if (exceeds_limits()) {
        return fail_in(file, ErrorKind::limit,
                       fmt::format("more than the limit of {} triangles or {} vertices", options_.max_triangles,
                                   options_.max_vertices));
      }
    }
    ImportedMesh result;
    values_.note_rest(result.warnings);
    result.attributes = std::move(attributes_);
    finish_attributes(result.attributes, assembly_.positions().size(), result.warnings);
    result.mesh = assembly_.finish(result.warnings);
    result.source_faces = assembly_.source_faces();
    result.polygons = assembly_.take_polygons();
    return result;
  }

 private:
  // Vertices are counted before they are read, but for those that corners add.
  bool exceeds_limits() const {
    return assembly_.triangle_count() > options_.max_triangles || vertex_total_ > options_.max_vertices;
  }

  Result<void> read_element(const PlyElement& element) {
    if (element.name == "vertex") return read_vertices(element);
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
      const PlyProperty& property = element.properties[p];
      if (property.name != "vertex_indices" && property.name != "vertex_index") continue;
      const bool strips = element.name == "tristrips";
      if (element.name != "face" && !strips) continue;
      if (!property.is_list || !is_integer(property.type)) {
        return values_.fail_here(element.name + "." + property.name + " must be a list of integers");
      }
      return read_faces(element, p, strips);
    }
    if (element.properties.empty()) return {};
    for (std::uint64_t i = 0; i < element.count; ++i) {
      for (const PlyProperty& property : element.properties) {
        if (!skip(property)) return values_.fail_value(fmt::format("{} {}: {}", element.name, i, property.name));
      }
    }
    return {};
  }

  // Before any memory is taken for an element, the rest of the file must be able to hold it.
  Result<void> check_size(const PlyElement& element) const {
    std::size_t bytes = 0;
    for (const PlyProperty& property : element.properties) {
      bytes += Values::min_value_bytes(property.is_list ? property.count_type : property.type);
    }
    if (bytes == 0 || element.count <= values_.remaining_bytes() / bytes) return {};
    return values_.fail_here(
        fmt::format("the header promises {} {} elements of at least {} bytes, but only {} bytes follow: the file is "
                    "truncated or its header is wrong",
                    element.count, quote(element.name), bytes, values_.remaining_bytes()));
  }

  bool skip(const PlyProperty& property) {
    if (!property.is_list) return values_.skip(property.type, 1);
    std::int64_t count = 0;
    return values_.integer(property.count_type, count) && count >= 0 &&
           values_.skip(property.type, static_cast<std::uint64_t>(count));
  }

  Result<void> read_vertices(const PlyElement& element) {
    constexpr std::string_view kAxes[] = {"x", "y", "z"};
    std::vector<int> axis_of(element.properties.size(), -1);
    for (int axis = 0; axis < 3; ++axis) {
      bool found = false;
      for (std::size_t p = 0; p < element.properties.size(); ++p) {
        if (element.properties[p].name != kAxes[axis] || element.properties[p].is_list) continue;
        axis_of[p] = axis;
        found = true;
      }
      if (!found) return values_.fail_here(fmt::format("the vertices have no property {}", kAxes[axis]));
    }
    if (options_.keep_attributes) find_attributes(element, axis_of);
    assembly_.reserve(vertex_count_, 0);
    for (std::uint64_t i = 0; i < element.count; ++i) {
      std::array<double, kParts> part{};
      part[kAlpha] = 1.0;
      for (std::size_t p = 0; p < axis_of.size(); ++p) {
        const PlyProperty& property = element.properties[p];
        const bool done = axis_of[p] < 0 ? skip(property)
                                         : values_.decimal(property.type, part[static_cast<std::size_t>(axis_of[p])]);
        if (!done) return values_.fail_value(fmt::format("vertex {}: {}", i, property.name));
      }
      const glm::dvec3 position(part[0], part[1], part[2]);
      if (const auto fault = position_fault(position)) return values_.fail_here(fmt::format("vertex {} {}", i, *fault));
      assembly_.positions().push_back(position);
      if (options_.keep_attributes) add_attributes(part);
    }
    return {};
  }

  // Places of a vertex's numbers while it is read: x, y, z, u, v, red, green, blue, alpha.
  static constexpr std::size_t kU = 3, kRed = 5, kAlpha = 8, kParts = 9;

  // Adds to the places of the properties those of attributes, and notes which are there as a whole.
  void find_attributes(const PlyElement& element, std::vector<int>& place_of) {
    constexpr std::array<std::string_view, 4> kColors = {"red", "green", "blue", "alpha"};
    constexpr std::array<std::array<std::string_view, 2>, 4> kTextures = {
        {{"u", "v"}, {"s", "t"}, {"texture_u", "texture_v"}, {"texture_s", "texture_t"}}};
    std::array<bool, kParts> found{};
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
      const PlyProperty& property = element.properties[p];
      std::string_view name = property.name;
      if (property.is_list || place_of[p] >= 0) continue;
      if (name.starts_with("diffuse_")) name.remove_prefix(8);
      std::size_t place = kParts;
      for (std::size_t c = 0; c < 4; ++c) place = name == kColors[c] ? kRed + c : place;
      for (const auto& pair : kTextures) {
        for (std::size_t c = 0; c < 2; ++c) place = name == pair[c] ? kU + c : place;
      }
      if (place == kParts || found[place]) continue;
      found[place] = true;
      place_of[p] = static_cast<int>(place);
      if (place >= kRed) color_scale_[place - kRed] = color_scale(property.type);
    }
    has_texture_ = found[kU] && found[kU + 1];
    has_color_ = found[kRed] && found[kRed + 1] && found[kRed + 2];
  }

  // Whole numbers stand for fractions of the largest their type holds.
  static double color_scale(PlyType type) {
    switch (type) {
      case PlyType::int8: return 1.0 / 127.0;
      case PlyType::int16: return 1.0 / 32767.0;
      case PlyType::uint16: return 1.0 / 65535.0;
      case PlyType::float32:
      case PlyType::float64: return 1.0;
      default: return 1.0 / 255.0;
    }
  }

  void add_attributes(const std::array<double, kParts>& part) {
    if (has_texture_) attributes_.texture_coordinates.push_back(v_turned_over({part[kU], part[kU + 1]}));
    if (!has_color_) return;
    std::array<double, 4> rgba{};
    for (std::size_t c = 0; c < 4; ++c) rgba[c] = part[kRed + c] * color_scale_[c];
    attributes_.colors.push_back(linear_color(rgba));
  }

  // MeshLab's texture coordinates at the corners of faces. False where the file ends.
  bool read_face_texture(const PlyProperty& property) {
    std::int64_t count = 0;
    if (!values_.integer(property.count_type, count) || count < 0) return false;
    if (static_cast<std::uint64_t>(count) > values_.remaining_bytes() / Values::min_value_bytes(property.type)) {
      return false;
    }
    face_texture_.clear();
    for (std::int64_t k = 0; k < count; ++k) {
      double value = 0.0;
      if (!values_.decimal(property.type, value)) return false;
      face_texture_.push_back(value);
    }
    return true;
  }

  // Where two corners at one vertex differ in texture coordinates, each gets a vertex of its own.
  void give_corners_their_texture() {
    auto& textures = attributes_.texture_coordinates;
    if (!corner_wedges_) corner_wedges_.emplace(vertex_count_);
    for (std::size_t k = 0; k < corners_.size(); ++k) {
      glm::dvec2 uv(face_texture_[2 * k], face_texture_[2 * k + 1]);
      if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) uv = glm::dvec2(0.0);
      uv = v_turned_over(uv);
      const std::size_t known = corner_wedges_->size();
      const VertexId wedge = corner_wedges_->add(corners_[k], uv);
      if (wedge == known) wedge_vertices_.push_back(vertex_for(corners_[k]));
      corners_[k] = wedge_vertices_[wedge];
      textures.resize(std::max<std::size_t>(textures.size(), corners_[k] + std::size_t{1}), glm::dvec2(0.0));
      textures[corners_[k]] = uv;
    }
  }

  // The vertex itself for the first texture coordinate at it, a copy for every other.
  VertexId vertex_for(VertexId vertex) {
    taken_.resize(vertex_count_, false);
    if (!taken_[vertex]) {
      taken_[vertex] = true;
      return vertex;
    }
    const glm::dvec3 position = assembly_.positions()[vertex];
    assembly_.positions().push_back(position);
    if (has_color_) {
      const glm::vec4 color = attributes_.colors[vertex];
      attributes_.colors.push_back(color);
    }
    vertex_total_ = assembly_.positions().size();
    return static_cast<VertexId>(vertex_total_ - 1);
  }

  Result<void> read_faces(const PlyElement& element, std::size_t list, bool strips) {
    if (!strips) assembly_.reserve(0, element.count);
    // Positions must be known to be copied.
    const bool keep = options_.keep_attributes && !strips && assembly_.positions().size() == vertex_count_;
    for (std::uint64_t i = 0; i < element.count; ++i) {
      face_texture_.clear();
      corners_.clear();
      for (std::size_t p = 0; p < element.properties.size(); ++p) {
        const PlyProperty& property = element.properties[p];
        if (keep && property.is_list && property.name == "texcoord" && !is_integer(property.type)) {
          if (!read_face_texture(property)) return values_.fail_value(fmt::format("face {}: texcoord", i));
          continue;
        }
        if (p != list) {
          if (!skip(property)) return values_.fail_value(fmt::format("{} {}: {}", element.name, i, property.name));
          continue;
        }
        if (Result<void> done = read_indices(element, i, property, strips); !done) return done;
        if (strips) add_strip();
      }
      if (face_texture_.size() == 2 * corners_.size() && !corners_.empty() && !strips) give_corners_their_texture();
      if (!strips) assembly_.add_polygon(corners_);
      if (exceeds_limits()) return {};  // run() reports it
    }
    return {};
  }

  static constexpr VertexId kRestart = std::numeric_limits<VertexId>::max();  // -1 between two strips

  Result<void> read_indices(const PlyElement& element, std::uint64_t i, const PlyProperty& property, bool strips) {
    std::int64_t count = 0;
    if (!values_.integer(property.count_type, count)) {
      return values_.fail_value(fmt::format("{} {}: the number of corners", element.name, i));
    }
    if (count < 0 ||
        static_cast<std::uint64_t>(count) > values_.remaining_bytes() / Values::min_value_bytes(property.type)) {
      return values_.fail_here(
          fmt::format("{} {} claims {} corners, but only {} bytes follow: the file is truncated or damaged",
                      element.name, i, count, values_.remaining_bytes()));
    }
    corners_.clear();
    for (std::int64_t k = 0; k < count; ++k) {
      std::int64_t index = 0;
      if (!values_.integer(property.type, index)) {
        return values_.fail_value(fmt::format("{} {}: corner {}", element.name, i, k));
      }
      const bool restart = strips && index == -1;
      if (!restart && (index < 0 || static_cast<std::uint64_t>(index) >= vertex_count_)) {
        return values_.fail_here(fmt::format("{} {}: corner {} names vertex {}, but there are {} vertices",
                                             element.name, i, k, index, vertex_count_));
      }
      corners_.push_back(restart ? kRestart : static_cast<VertexId>(index));
    }
    return {};
  }

  void add_strip() {
    std::size_t first = 0;
    for (std::size_t k = 0; k < corners_.size(); ++k) {
      if (corners_[k] == kRestart) {
        first = k + 1;
      } else if (k >= first + 2) {
        const bool even = (k - first) % 2 == 0;
        assembly_.add_triangle({corners_[k - (even ? 2 : 1)], corners_[k - (even ? 1 : 2)], corners_[k]});
      }
    }
  }

  const PlyHeader& header_;
  const ImportOptions& options_;
  Values values_;
  MeshAssembly assembly_{options_.keep_polygons};
  std::uint64_t vertex_count_ = 0;
  std::uint64_t vertex_total_ = 0;    // with those that corners have added
  std::vector<VertexId> corners_;     // of the face at hand
  std::vector<double> face_texture_;  // likewise, two for each corner
  VertexAttributes attributes_;
  bool has_texture_ = false, has_color_ = false;
  std::array<double, 4> color_scale_{1.0, 1.0, 1.0, 1.0};
  std::optional<WedgeTable<glm::dvec2>> corner_wedges_;
  std::vector<VertexId> wedge_vertices_;  // of the wedges
  std::vector<bool> taken_;               // vertices that have a texture coordinate of a corner
};

template <class Values>
Result<ImportedMesh> read_body(const InputFile& file, const PlyHeader& header, const ImportOptions& options) {
  return BodyReader<Values>(header, options, Values(file, header.size_bytes)).run(file);
}

}  // namespace

Result<ImportedMesh> read_ply(const InputFile& file, const ImportOptions& options) {
  const Result<PlyHeader> header = read_ply_header(file);
  if (!header) return tl::unexpected(header.error());
  static_assert(std::endian::native == std::endian::little, "byte order of the host is assumed little-endian");
  switch (header->encoding) {
    case PlyHeader::Encoding::text: return read_body<TextValues>(file, *header, options);
    case PlyHeader::Encoding::little_endian: return read_body<BinaryValues<false>>(file, *header, options);
    case PlyHeader::Encoding::big_endian: break;
  }
  return read_body<BinaryValues<true>>(file, *header, options);
}

}  // namespace fanstream
