// OBJ: Wavefront's format, its polygonal part. Our own reader: the packaged tinyobjloader rounds decimals differently
// from every other program, gives errors without a line, and has a history of reading past its buffers.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>

#include "common/import/attribute_lists.h"
#include "common/import/mesh_assembly.h"
#include "common/import/readers.h"
#include "common/import/text_scanner.h"

namespace fanstream {
namespace {

constexpr std::array<std::string_view, 14> kIgnoredKeywords = {
    "vt", "vn", "g", "o", "s", "usemtl", "mtllib", "p", "l", "lod", "shadow_obj", "trace_obj", "bevel", "call"};
constexpr std::array<std::string_view, 18> kFreeFormKeywords = {"vp",    "deg",  "bmat", "step", "cstype", "curv",
                                                                "curv2", "surf", "parm", "trim", "hole",   "scrv",
                                                                "sp",    "end",  "con",  "mg",   "ctech",  "stech"};

constexpr double kMinWeight = 1e-30;  // beyond it, and kMaxCoordinate, weighted coordinates overflow

class ObjReader {
 public:
  ObjReader(const InputFile& file, const ImportOptions& options)
      : file_(file), options_(options), scanner_(file, file.bytes(), '#') {}

  Result<ImportedMesh> run() {
    for (scanner_.skip_space(); !scanner_.at_end(); scanner_.skip_space()) {
      const char* line = scanner_.place();
      const std::string_view keyword = scanner_.word();
      if (keyword == "v") {
        if (auto done = read_vertex(); !done) return tl::unexpected(done.error());
      } else if (keyword == "vt" && options_.keep_attributes) {
        read_texture_coordinate();
      } else if (keyword == "f" || keyword == "fo") {
        if (auto done = read_face(line); !done) return tl::unexpected(done.error());
      } else if (auto done = ignore(keyword, line); !done) {
        return tl::unexpected(done.error());
      }
    }
    if (highest_forward_index_ > assembly_.positions().size()) {
      return scanner_.fail_at(highest_forward_place_,
                              fmt::format("the face names vertex {}, but the file has {} vertices",
                                          highest_forward_index_, assembly_.positions().size()));
    }
    ImportedMesh result;
    if (options_.keep_attributes) {
      if (auto done = make_wedges(result); !done) return tl::unexpected(done.error());
    }
    note_oddities(result.warnings);
    result.mesh = assembly_.finish(result.warnings);
    result.source_faces = assembly_.source_faces();
    result.polygons = assembly_.take_polygons();
    return result;
  }

 private:
  Result<void> read_vertex() {
    glm::dvec3 position(0);
    for (int axis = 0; axis < 3; ++axis) {
      if (auto done = skip_blanks_and_continuations(); !done) return done;
      const TextScanner::Number fault = scanner_.number(position[axis]);
      if (fault != TextScanner::Number::ok) {
        return scanner_.fail_number(fault, fmt::format("vertex {}: a coordinate", assembly_.positions().size() + 1));
      }
    }
    if (const auto fault = position_fault(position)) {
      return scanner_.fail_here(fmt::format("vertex {} {}", assembly_.positions().size() + 1, *fault));
    }
    if (assembly_.positions().size() >= options_.max_vertices) {
      return fail_in(file_, ErrorKind::limit, fmt::format("more than the limit of {} vertices", options_.max_vertices));
    }
    assembly_.positions().push_back(position);
    if (assembly_.keeps_polygons()) {
      if (auto done = read_weight(); !done) return done;
    }
    if (options_.keep_attributes) read_color();
    skip_logical_line();  // a weight or a colour may follow
    return {};
  }

  // One number behind the coordinates is the weight of a rational vertex; three are a colour.
  Result<void> read_weight() {
    const char* place = scanner_.place();
    double weight = 1.0;
    double more = 0.0;
    int count = 0;
    scanner_.skip_blanks();
    while (count < 2 && scanner_.number(count == 0 ? weight : more) == TextScanner::Number::ok) {
      ++count;
      scanner_.skip_blanks();
    }
    if (count == 1) {
      if (!(weight >= kMinWeight && weight <= kMaxCoordinate)) {
        return scanner_.fail_at(
            place,
            fmt::format("vertex {}: the weight {} is not above 0: such points lie nowhere, or it is not a weight",
                        assembly_.positions().size(), weight));
      }
      assembly_.set_weight(weight);
    }
    scanner_.move_to(place);
    return {};
  }

  Result<void> read_face(const char* line) {
    corners_.clear();
    corner_textures_.clear();
    while (true) {
      if (auto done = skip_blanks_and_continuations(); !done) return done;
      if (!scanner_.has_word_in_line()) break;
      if (auto done = read_corner(); !done) return done;
    }
    if (corners_.empty()) return scanner_.fail_at(line, "the face has no corners: the file may be truncated");
    if (options_.keep_attributes) {
      faces_.push_back(static_cast<std::uint32_t>(corners_.size()));
      for (std::size_t i = 0; i < corners_.size(); ++i) face_corners_.push_back({corners_[i], corner_textures_[i]});
      face_triangles_ += corners_.size() - std::min<std::size_t>(corners_.size(), 2);
    } else {
      assembly_.add_polygon(corners_);
    }
    if (std::max(assembly_.triangle_count(), face_triangles_) > options_.max_triangles) {
      return fail_in(file_, ErrorKind::limit,
                     fmt::format("more than the limit of {} triangles", options_.max_triangles));
    }
    return {};
  }

  // "7", "7/1", "7//3", "7/1/3"; negative numbers count back from the latest vertex. Only the first number matters.
  Result<void> read_corner() {
    const char* place = scanner_.place();
    const std::string_view word = scanner_.word();
    std::int64_t index = 0;
    const auto [behind, fault] = std::from_chars(word.data(), word.data() + word.size(), index);
    if (fault != std::errc() || (behind != word.data() + word.size() && *behind != '/')) {
      return scanner_.fail_at(place, "a corner must begin with a vertex number, but is " + quote(word));
    }
    const auto count = static_cast<std::int64_t>(assembly_.positions().size());
    const std::int64_t resolved = index < 0 ? count + 1 + index : index;
    if (index == 0 || resolved < 1) {
      return scanner_.fail_at(place,
                              fmt::format("the face names vertex {}, but {} vertices come before it", index, count));
    }
    // A vertex may come later in the file; whether it does is seen at the end.
    if (resolved > count && static_cast<std::uint64_t>(resolved) > highest_forward_index_) {
      highest_forward_index_ = static_cast<std::uint64_t>(resolved);
      highest_forward_place_ = place;
      if (highest_forward_index_ > options_.max_vertices) {
        return scanner_.fail_at(place, fmt::format("the face names vertex {}, but the file has not so many", resolved));
      }
    }
    corners_.push_back(static_cast<VertexId>(resolved - 1));
    if (options_.keep_attributes)
      corner_textures_.push_back(texture_of(word.substr(static_cast<std::size_t>(behind - word.data()))));
    return {};
  }

  // A colour behind a position, three numbers, as many programs write it.
  void read_color() {
    std::array<double, 4> rgba{1.0, 1.0, 1.0, 1.0};
    std::size_t count = 0;
    for (double number = 0; count < 5; ++count) {
      scanner_.skip_blanks();
      if (scanner_.number(number) != TextScanner::Number::ok) break;
      if (count < 3) rgba[count] = number;
    }
    if (count != 3) return;
    colors_.resize(assembly_.positions().size() - 1, glm::vec4(1.0F));
    colors_.push_back(linear_color(rgba));
  }

  void read_texture_coordinate() {
    glm::dvec2 uv(0.0);  // v may be left out
    for (int axis = 0; axis < 2; ++axis) {
      scanner_.skip_blanks();
      if (scanner_.number(uv[axis]) != TextScanner::Number::ok) break;
    }
    textures_.push_back(v_turned_over(uv));
    skip_logical_line();
  }

  // The second number of "7/1/3", counted from 0, or kNoTexture. It may come later in the file.
  std::uint32_t texture_of(std::string_view rest) const {
    if (rest.size() < 2 || rest[0] != '/' || rest[1] == '/') return kNoTexture;
    std::int64_t index = 0;
    rest.remove_prefix(1);
    const auto [behind, fault] = std::from_chars(rest.data(), rest.data() + rest.size(), index);
    if (fault != std::errc() || (behind != rest.data() + rest.size() && *behind != '/')) return kUnknownTexture;
    if (index < 0) index += static_cast<std::int64_t>(textures_.size()) + 1;
    return index < 1 || index >= kUnknownTexture ? kUnknownTexture : static_cast<std::uint32_t>(index - 1);
  }

  // One vertex for each position and texture coordinate that meet at a corner.
  Result<void> make_wedges(ImportedMesh& result) {
    WedgeTable<std::uint32_t> wedges(assembly_.positions().size());
    std::size_t at = 0;
    for (const std::uint32_t size : faces_) {
      corners_.clear();
      for (std::size_t end = at + size; at < end; ++at) {
        std::uint32_t texture = face_corners_[at][1];
        if (texture != kNoTexture && texture >= textures_.size()) {
          ++unknown_textures_;
          texture = kNoTexture;
        }
        corners_.push_back(wedges.add(face_corners_[at][0], texture));
      }
      assembly_.add_polygon(corners_);
    }
    if (wedges.size() > options_.max_vertices) {
      return fail_in(file_, ErrorKind::limit, fmt::format("more than the limit of {} vertices", options_.max_vertices));
    }
    std::vector<glm::dvec3> positions;
    positions.reserve(wedges.size());
    VertexAttributes& attributes = result.attributes;
    for (std::size_t w = 0; w < wedges.size(); ++w) {
      const VertexId position = wedges.position(w);
      positions.push_back(assembly_.positions()[position]);
      if (!textures_.empty()) {
        attributes.texture_coordinates.push_back(wedges.key(w) == kNoTexture ? glm::dvec2(0)
                                                                             : textures_[wedges.key(w)]);
      }
      if (!colors_.empty()) {
        attributes.colors.push_back(position < colors_.size() ? colors_[position] : glm::vec4(1.0F));
      }
    }
    assembly_.positions() = std::move(positions);
    finish_attributes(attributes, wedges.size(), result.warnings);
    return {};
  }

  Result<void> ignore(std::string_view keyword, const char* line) {
    const auto is = [keyword](std::string_view other) { return keyword == other; };
    if (std::any_of(kFreeFormKeywords.begin(), kFreeFormKeywords.end(), is)) {
      ++free_form_lines_;
    } else if (std::none_of(kIgnoredKeywords.begin(), kIgnoredKeywords.end(), is)) {
      if (keyword.find('\0') != std::string_view::npos) {
        return scanner_.fail_at(line, "binary data in a text format: this is not an OBJ file, or it is damaged");
      }
      if (unknown_lines_++ == 0) {
        first_unknown_ = keyword;
        first_unknown_place_ = line;
      }
    }
    skip_logical_line();
    return {};
  }

  // A backslash before the line end continues the line.
  Result<void> skip_blanks_and_continuations() {
    while (true) {
      scanner_.skip_blanks();
      const char* place = scanner_.place();
      if (scanner_.word() != "\\") {
        scanner_.move_to(place);
        return {};
      }
      if (scanner_.has_word_in_line()) return scanner_.fail_at(place, "a backslash must be the last of its line");
      scanner_.skip_line();
    }
  }

  void skip_logical_line() {
    for (bool continues = true; continues && !scanner_.at_end();) {
      const char* begin = scanner_.place();
      scanner_.skip_line();
      const char* end = scanner_.place();
      while (end != begin && (end[-1] == '\n' || end[-1] == '\r')) --end;
      continues = end != begin && end[-1] == '\\';
    }
  }

  void note_oddities(std::vector<std::string>& warnings) const {
    if (free_form_lines_ > 0) {
      warnings.push_back(fmt::format("{} lines of free-form curves and surfaces were ignored.", free_form_lines_));
    }
    if (unknown_lines_ > 0) {
      warnings.push_back(fmt::format("Line {}: the unknown keyword {} and {} other such lines were ignored.",
                                     scanner_.line_at(first_unknown_place_), quote(first_unknown_),
                                     unknown_lines_ - 1));
    }
    if (unknown_textures_ > 0) {
      warnings.push_back(
          fmt::format("{} corners name texture coordinates that the file does not have.", unknown_textures_));
    }
    if (file_.bytes().back() != '\n') {
      warnings.emplace_back("The text ends within a line: the file may be truncated.");
    }
  }

  const InputFile& file_;
  const ImportOptions& options_;
  TextScanner scanner_;
  MeshAssembly assembly_{options_.keep_polygons};
  std::vector<VertexId> corners_;  // of the face at hand
  std::uint64_t highest_forward_index_ = 0;
  const char* highest_forward_place_ = nullptr;
  // With keep_attributes, until the end, when everything that corners name is known: a position and a texture
  // coordinate.
  static constexpr std::uint32_t kNoTexture = 0xFFFFFFFFU, kUnknownTexture = 0xFFFFFFFEU;
  std::vector<std::uint32_t> corner_textures_;  // of the face at hand
  std::vector<std::array<std::uint32_t, 2>> face_corners_;
  std::vector<std::uint32_t> faces_;  // corners of each
  std::size_t face_triangles_ = 0;
  std::vector<glm::dvec2> textures_;
  std::vector<glm::vec4> colors_;
  std::size_t unknown_textures_ = 0;
  std::size_t free_form_lines_ = 0;
  std::size_t unknown_lines_ = 0;
  std::string_view first_unknown_;
  const char* first_unknown_place_ = nullptr;
};

}  // namespace

Result<ImportedMesh> read_obj(const InputFile& file, const ImportOptions& options) {
  return ObjReader(file, options).run();
}

}  // namespace fanstream
