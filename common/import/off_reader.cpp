// OFF: Geomview's Object File Format in text, with the prefixes ST, C and N (texture, colour, normal), whose values are
// ignored but for colours and texture coordinates that are asked for. Colours behind faces are ignored.
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "common/import/attribute_lists.h"
#include "common/import/mesh_assembly.h"
#include "common/import/readers.h"
#include "common/import/text_scanner.h"

namespace fanstream {
namespace {

class OffReader {
 public:
  OffReader(const InputFile& file, const ImportOptions& options)
      : file_(file), options_(options), scanner_(file, file.bytes(), '#') {}

  Result<ImportedMesh> run() {
    if (auto done = read_header(); !done) return tl::unexpected(done.error());
    assembly_.reserve(vertex_count_, face_count_);
    for (std::size_t i = 0; i < vertex_count_; ++i) {
      if (auto done = read_vertex(i); !done) return tl::unexpected(done.error());
    }
    for (std::size_t i = 0; i < face_count_; ++i) {
      if (auto done = read_face(i); !done) return tl::unexpected(done.error());
    }
    ImportedMesh result;
    if (scanner_.at_end() && file_.bytes().back() != '\n') {
      result.warnings.emplace_back("The text ends within a line: the file may be truncated.");
    }
    scanner_.skip_space();
    if (!scanner_.at_end()) {
      result.warnings.push_back(
          fmt::format("Line {}: what follows the last face was ignored.", scanner_.line_at(scanner_.place())));
    }
    if (options_.keep_attributes) take_attributes(result);
    result.mesh = assembly_.finish(result.warnings);
    result.source_faces = assembly_.source_faces();
    result.polygons = assembly_.take_polygons();
    return result;
  }

 private:
  Result<void> read_header() {
    scanner_.skip_space();
    const char* place = scanner_.place();
    std::string_view keyword = scanner_.word();
    if (keyword.ends_with("OFF")) {
      const std::string_view prefix = keyword.substr(0, keyword.size() - 3);
      if (prefix.find_first_not_of("STCN") != std::string_view::npos) {
        return fail(ErrorKind::unsupported,
                    fmt::format("{}: {} files have other than three coordinates: convert to OFF", file_.name(),
                                quote(keyword)));
      }
      has_texture_ = prefix.find("ST") != std::string_view::npos;
      has_color_ = prefix.find('C') != std::string_view::npos;
      has_normal_ = prefix.find('N') != std::string_view::npos;
      scanner_.skip_blanks();
      const char* behind = scanner_.place();
      if (scanner_.word() == "BINARY") {
        return fail(ErrorKind::unsupported, fmt::format("{}: binary OFF: convert to text OFF or PLY", file_.name()));
      }
      scanner_.move_to(behind);
    } else {
      scanner_.move_to(place);  // the keyword is optional
    }
    std::int64_t vertices = 0;
    std::int64_t faces = 0;
    for (const auto& [value, what] :
         {std::pair{&vertices, "the number of vertices"}, {&faces, "the number of faces"}}) {
      scanner_.skip_space();
      const TextScanner::Number fault = scanner_.number(*value);
      if (fault != TextScanner::Number::ok) return scanner_.fail_number(fault, what);
      if (*value < 0) return scanner_.fail_here(fmt::format("{} is negative", what));
    }
    scanner_.skip_line();  // the number of edges, which nobody fills in
    return check_counts(static_cast<std::uint64_t>(vertices), static_cast<std::uint64_t>(faces));
  }

  // A vertex takes at least six characters, a face that of one corner four; the last line end may be missing.
  Result<void> check_counts(std::uint64_t vertices, std::uint64_t faces) {
    const std::uint64_t room = scanner_.remaining_bytes() + 1;
    if (vertices > room / 6 || faces > room / 4 || 6 * vertices + 4 * faces > room) {
      return scanner_.fail_here(
          fmt::format("the header promises {} vertices and {} faces, but only {} bytes follow: the "
                      "file is truncated or its header is wrong",
                      vertices, faces, scanner_.remaining_bytes()));
    }
    if (vertices > options_.max_vertices || faces > options_.max_triangles) return fail_limit();
    vertex_count_ = vertices;
    face_count_ = faces;
    return {};
  }

  tl::unexpected<Error> fail_limit() const {
    return fail_in(file_, ErrorKind::limit,
                   fmt::format("more than the limit of {} vertices or {} triangles", options_.max_vertices,
                               options_.max_triangles));
  }

  Result<void> read_vertex(std::size_t i) {
    glm::dvec3 position(0);
    scanner_.skip_space();
    for (int axis = 0; axis < 3; ++axis) {
      scanner_.skip_blanks();
      const TextScanner::Number fault = scanner_.number(position[axis]);
      if (fault != TextScanner::Number::ok)
        return scanner_.fail_number(fault, fmt::format("vertex {}: a coordinate", i));
    }
    if (const auto fault = position_fault(position)) return scanner_.fail_here(fmt::format("vertex {} {}", i, *fault));
    assembly_.positions().push_back(position);
    if (options_.keep_attributes && (has_color_ || has_texture_)) read_attributes();
    scanner_.skip_line();
    return {};
  }

  // Behind a position: normal, colour, texture coordinates. What is missing or no number stays as it is by default.
  void read_attributes() {
    std::array<double, 9> numbers{};
    std::size_t count = 0;
    for (; count < numbers.size(); ++count) {
      scanner_.skip_blanks();
      if (scanner_.number(numbers[count]) != TextScanner::Number::ok) break;
    }
    std::size_t at = has_normal_ ? 3 : 0;
    if (has_color_) {
      const std::size_t end = count - std::min<std::size_t>(count, has_texture_ ? 2 : 0);
      std::array<double, 4> rgba{-1.0, -1.0, -1.0, -1.0};  // marks what is missing: the scale is not known yet
      for (std::size_t c = 0; c < 4 && at < end; ++c) rgba[c] = numbers[at++];
      for (const double part : rgba) largest_color_ = std::max(largest_color_, part);
      colors_.push_back(rgba);
    }
    if (has_texture_) {
      textures_.push_back(at + 2 <= count ? v_turned_over({numbers[at], numbers[at + 1]}) : glm::dvec2(0));
    }
  }

  // Colours are whole numbers up to 255 or fractions up to 1; the largest of the file tells.
  void take_attributes(ImportedMesh& result) {
    const double scale = largest_color_ > 1.0 ? 1.0 / 255.0 : 1.0;
    for (std::array<double, 4>& rgba : colors_) {
      for (double& part : rgba) part = part < 0.0 ? 1.0 : part * scale;
      result.attributes.colors.push_back(linear_color(rgba));
    }
    result.attributes.texture_coordinates = std::move(textures_);
    finish_attributes(result.attributes, assembly_.positions().size(), result.warnings);
  }

  Result<void> read_face(std::size_t i) {
    std::int64_t size = 0;
    scanner_.skip_space();
    TextScanner::Number fault = scanner_.number(size);
    if (fault != TextScanner::Number::ok)
      return scanner_.fail_number(fault, fmt::format("face {}: the number of corners", i));
    if (size < 0 || static_cast<std::uint64_t>(size) > scanner_.remaining_bytes() / 2) {
      return scanner_.fail_here(
          fmt::format("face {} claims {} corners, but only {} bytes follow: the file is truncated or "
                      "damaged",
                      i, size, scanner_.remaining_bytes()));
    }
    corners_.clear();
    for (std::int64_t k = 0; k < size; ++k) {
      std::int64_t index = 0;
      scanner_.skip_blanks();
      const char* place = scanner_.place();
      fault = scanner_.number(index);
      if (fault != TextScanner::Number::ok) return scanner_.fail_number(fault, fmt::format("face {}: corner {}", i, k));
      if (index < 0 || static_cast<std::uint64_t>(index) >= vertex_count_) {
        return scanner_.fail_at(place, fmt::format("face {}: corner {} names vertex {}, but there are {} vertices", i,
                                                   k, index, vertex_count_));
      }
      corners_.push_back(static_cast<VertexId>(index));
    }
    assembly_.add_polygon(corners_);
    if (assembly_.triangle_count() > options_.max_triangles) return fail_limit();
    scanner_.skip_line();
    return {};
  }

  const InputFile& file_;
  const ImportOptions& options_;
  TextScanner scanner_;
  MeshAssembly assembly_{options_.keep_polygons};
  std::uint64_t vertex_count_ = 0;
  std::uint64_t face_count_ = 0;
  std::vector<VertexId> corners_;  // of the face at hand
  bool has_texture_ = false, has_color_ = false, has_normal_ = false;
  std::vector<std::array<double, 4>> colors_;  // as they stand in the file
  double largest_color_ = 0.0;
  std::vector<glm::dvec2> textures_;
};

}  // namespace

Result<ImportedMesh> read_off(const InputFile& file, const ImportOptions& options) {
  return OffReader(file, options).run();
}

}  // namespace fanstream
