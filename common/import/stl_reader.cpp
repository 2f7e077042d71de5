// STL: 3D Systems' StereoLithography interface, text and binary. Facet normals and attributes are ignored.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "common/import/mesh_assembly.h"
#include "common/import/readers.h"
#include "common/import/text_scanner.h"

namespace fanstream {
namespace {

constexpr std::size_t kHeaderBytes = 84;  // 80 of free text, 4 of facet count
constexpr std::size_t kFacetBytes = 50;   // 12 floats, 2 bytes of attributes

std::uint32_t claimed_facets(std::string_view bytes) {
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + kHeaderBytes - sizeof count, sizeof count);
  return count;
}

bool equals_ignoring_case(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char x, char y) { return (x >= 'A' && x <= 'Z' ? x - 'A' + 'a' : x) == y; });
}

Result<ImportedMesh> read_binary(const InputFile& file, const ImportOptions& options) {
  const std::string_view bytes = file.bytes();
  if (bytes.size() < kHeaderBytes) {
    return fail_at_byte(file, bytes.size(),
                        "the file ends within the 84 bytes of a binary STL header: it is truncated");
  }
  const std::size_t count = claimed_facets(bytes);
  const std::size_t held = (bytes.size() - kHeaderBytes) / kFacetBytes;
  if (count > held) {
    return fail_at_byte(
        file, kHeaderBytes - 4,
        fmt::format("the header promises {} facets, but the file holds {}: it is truncated, or not a mesh", count,
                    held));
  }
  if (count > options.max_triangles || 3 * count > options.max_vertices) {
    return fail_in(file, ErrorKind::limit,
                   fmt::format("{} triangles, more than the limit of {} triangles or {} vertices", count,
                               options.max_triangles, options.max_vertices));
  }
  ImportedMesh result;
  result.mesh.positions.reserve(3 * count);
  result.mesh.triangles.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t offset = kHeaderBytes + i * kFacetBytes + 12;
    float corners[9];
    std::memcpy(corners, bytes.data() + offset, sizeof corners);
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::dvec3 position(corners[3 * k], corners[3 * k + 1], corners[3 * k + 2]);
      if (const auto fault = position_fault(position)) {
        return fail_at_byte(file, offset + 12 * k, fmt::format("facet {}: corner {} {}", i, k, *fault));
      }
      result.mesh.positions.push_back(position);
    }
    const auto first = static_cast<VertexId>(3 * i);
    result.mesh.triangles.push_back({first, first + 1, first + 2});
  }
  const std::size_t used = kHeaderBytes + count * kFacetBytes;
  if (used < bytes.size()) {
    result.warnings.push_back(
        fmt::format("Byte {}: {} bytes behind the last facet were ignored.", used, bytes.size() - used));
  }
  return result;
}

class TextReader {
 public:
  TextReader(const InputFile& file, const ImportOptions& options)
      : file_(file), options_(options), scanner_(file, file.bytes()) {}

  Result<ImportedMesh> run() {
    for (scanner_.skip_space(); !scanner_.at_end(); scanner_.skip_space()) {
      if (auto done = read_solid(); !done) return tl::unexpected(done.error());
    }
    ImportedMesh result;
    result.mesh = assembly_.finish(result.warnings);
    return result;
  }

 private:
  // Moves behind `wanted`, or stays.
  bool accept(std::string_view wanted) {
    scanner_.skip_space();
    const char* place = scanner_.place();
    if (equals_ignoring_case(scanner_.word(), wanted)) return true;
    scanner_.move_to(place);
    return false;
  }

  Result<void> expect(std::string_view wanted) {
    if (accept(wanted)) return {};
    if (scanner_.at_end()) {
      return scanner_.fail_here(fmt::format("'{}' expected, but the file ends here: it may be truncated", wanted));
    }
    const char* place = scanner_.place();
    return scanner_.fail_at(place, fmt::format("'{}' expected, but {} found", wanted, quote(scanner_.word())));
  }

  Result<void> read_solid() {
    if (auto done = expect("solid"); !done) return done;
    scanner_.skip_line();
    while (accept("facet")) {
      if (auto done = read_facet(); !done) return done;
    }
    if (auto done = expect("endsolid"); !done) return done;
    scanner_.skip_line();
    return {};
  }

  Result<void> read_facet() {
    if (auto done = expect("normal"); !done) return done;
    for (int axis = 0; axis < 3; ++axis) {
      scanner_.skip_space();
      scanner_.word();  // some writers put nan here
    }
    if (auto done = expect("outer"); !done) return done;
    if (auto done = expect("loop"); !done) return done;
    corners_.clear();
    while (accept("vertex")) {
      if (auto done = read_vertex(); !done) return done;
    }
    if (auto done = expect("endloop"); !done) return done;
    if (auto done = expect("endfacet"); !done) return done;
    if (corners_.size() < 3) return scanner_.fail_here(fmt::format("the facet has {} corners", corners_.size()));
    assembly_.add_polygon(corners_);
    if (assembly_.triangle_count() > options_.max_triangles) {
      return fail_in(file_, ErrorKind::limit,
                     fmt::format("more than the limit of {} triangles", options_.max_triangles));
    }
    return {};
  }

  Result<void> read_vertex() {
    glm::dvec3 position(0);
    for (int axis = 0; axis < 3; ++axis) {
      scanner_.skip_space();
      const TextScanner::Number fault = scanner_.number(position[axis]);
      if (fault != TextScanner::Number::ok) return scanner_.fail_number(fault, "a coordinate");
    }
    if (const auto fault = position_fault(position)) return scanner_.fail_here(fmt::format("the corner {}", *fault));
    if (assembly_.positions().size() >= options_.max_vertices) {
      return fail_in(file_, ErrorKind::limit, fmt::format("more than the limit of {} vertices", options_.max_vertices));
    }
    corners_.push_back(static_cast<VertexId>(assembly_.positions().size()));
    assembly_.positions().push_back(position);
    return {};
  }

  const InputFile& file_;
  const ImportOptions& options_;
  TextScanner scanner_;
  MeshAssembly assembly_;
  std::vector<VertexId> corners_;  // of the facet at hand
};

}  // namespace

bool looks_like_binary_stl(std::string_view bytes) {
  if (bytes.size() < kHeaderBytes + kFacetBytes) return false;
  return bytes.size() == kHeaderBytes + std::size_t{claimed_facets(bytes)} * kFacetBytes;
}

// Binary files may begin with "solid" too, so a second word of the grammar must follow early, and no zero byte.
bool looks_like_text_stl(std::string_view bytes) {
  if (bytes.starts_with("\xEF\xBB\xBF")) bytes.remove_prefix(3);  // UTF-8's byte order mark
  const std::string_view start = bytes.substr(0, 1024);
  const std::size_t first = start.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos || !equals_ignoring_case(start.substr(first, 5), "solid")) return false;
  if (start.find('\0') != std::string_view::npos) return false;
  std::string lower(start.substr(first + 5));
  for (char& c : lower) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return lower.find("facet") != std::string::npos || lower.find("endsolid") != std::string::npos;
}

Result<ImportedMesh> read_stl(const InputFile& file, const ImportOptions& options) {
  if (!looks_like_binary_stl(file.bytes()) && looks_like_text_stl(file.bytes())) return TextReader(file, options).run();
  return read_binary(file, options);
}

}  // namespace fanstream
