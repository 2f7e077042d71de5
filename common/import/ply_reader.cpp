// PLY: Greg Turk's "The PLY Polygon File Format" (1994), with the type names of later writers.
#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <limits>

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
      if (assembly_.triangle_count() > options_.max_triangles) {
        return fail_in(file, ErrorKind::limit,
                       fmt::format("more than the limit of {} triangles", options_.max_triangles));
      }
    }
    ImportedMesh result;
    values_.note_rest(result.warnings);
    result.mesh = assembly_.finish(result.warnings);
    result.source_faces = assembly_.source_faces();
    result.polygons = assembly_.take_polygons();
    return result;
  }

 private:
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
    assembly_.reserve(vertex_count_, 0);
    for (std::uint64_t i = 0; i < element.count; ++i) {
      glm::dvec3 position(0);
      for (std::size_t p = 0; p < axis_of.size(); ++p) {
        const PlyProperty& property = element.properties[p];
        const bool done = axis_of[p] < 0 ? skip(property) : values_.decimal(property.type, position[axis_of[p]]);
        if (!done) return values_.fail_value(fmt::format("vertex {}: {}", i, property.name));
      }
      if (const auto fault = position_fault(position)) return values_.fail_here(fmt::format("vertex {} {}", i, *fault));
      assembly_.positions().push_back(position);
    }
    return {};
  }

  Result<void> read_faces(const PlyElement& element, std::size_t list, bool strips) {
    if (!strips) assembly_.reserve(0, element.count);
    for (std::uint64_t i = 0; i < element.count; ++i) {
      for (std::size_t p = 0; p < element.properties.size(); ++p) {
        const PlyProperty& property = element.properties[p];
        if (p != list) {
          if (!skip(property)) return values_.fail_value(fmt::format("{} {}: {}", element.name, i, property.name));
          continue;
        }
        if (Result<void> done = read_indices(element, i, property, strips); !done) return done;
        if (strips) {
          add_strip();
        } else {
          assembly_.add_polygon(corners_);
        }
      }
      if (assembly_.triangle_count() > options_.max_triangles) return {};  // run() reports it
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
  std::vector<VertexId> corners_;  // of the face at hand
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
