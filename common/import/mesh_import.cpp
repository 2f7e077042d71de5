#include "common/import/mesh_import.h"

#include <fmt/format.h>

#include <algorithm>
#include <new>
#include <optional>

#include "common/import/input_file.h"
#include "common/import/readers.h"

namespace fanstream {
namespace {

std::optional<MeshFormat> format_of_extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  if (extension == ".ply") return MeshFormat::ply;
  if (extension == ".stl") return MeshFormat::stl;
  if (extension == ".obj") return MeshFormat::obj;
  if (extension == ".off") return MeshFormat::off;
  if (extension == ".gltf") return MeshFormat::gltf;
  if (extension == ".glb") return MeshFormat::glb;
  return std::nullopt;
}

// The first word that is not in a line of comment.
std::string_view first_word(std::string_view text) {
  while (!text.empty()) {
    const std::size_t begin = text.find_first_not_of(" \t\r\n");
    if (begin == std::string_view::npos) return {};
    text.remove_prefix(begin);
    if (text[0] != '#') return text.substr(0, text.find_first_of(" \t\r\n"));
    text.remove_prefix(std::min(text.size(), text.find('\n')));
  }
  return {};
}

std::optional<MeshFormat> format_of_content(std::string_view bytes) {
  if (bytes.starts_with("\xEF\xBB\xBF")) bytes.remove_prefix(3);  // UTF-8's byte order mark
  if (bytes.starts_with("glTF")) return MeshFormat::glb;
  if (bytes.starts_with("ply\n") || bytes.starts_with("ply\r") || bytes.starts_with("ply ")) return MeshFormat::ply;
  if (looks_like_binary_stl(bytes)) return MeshFormat::stl;
  const std::string_view word = first_word(bytes.substr(0, 1 << 16));
  if (word.starts_with("{")) return MeshFormat::gltf;
  if (word == "OFF" || word == "COFF" || word == "NOFF" || word == "CNOFF" || word == "STOFF" || word == "4OFF") {
    return MeshFormat::off;
  }
  if (looks_like_text_stl(bytes)) return MeshFormat::stl;
  for (const std::string_view keyword : {"v", "vn", "vt", "f", "o", "g", "mtllib", "usemtl"}) {
    if (word == keyword) return MeshFormat::obj;
  }
  return std::nullopt;
}

Result<ImportedMesh> read(const InputFile& file, MeshFormat format, const ImportOptions& options) {
  switch (format) {
    case MeshFormat::ply: return read_ply(file, options);
    case MeshFormat::stl: return read_stl(file, options);
    case MeshFormat::obj: return read_obj(file, options);
    case MeshFormat::off: return read_off(file, options);
    case MeshFormat::gltf:
    case MeshFormat::glb: break;
  }
  return read_gltf(file, options);
}

Result<ImportedMesh> import_unguarded(const Result<InputFile>& file, const ImportOptions& options) {
  if (!file) return tl::unexpected(file.error());
  const std::optional<MeshFormat> content = format_of_content(file->bytes());
  const std::optional<MeshFormat> extension = format_of_extension(file->path());
  const std::optional<MeshFormat> format = content ? content : extension;
  if (!format) {
    return fail_in(*file, ErrorKind::unsupported,
                   "is none of the formats that can be imported: PLY, STL, OBJ, OFF, glTF, GLB");
  }
  Result<ImportedMesh> result = read(*file, *format, options);
  if (!result) return result;
  if (result->mesh.triangles.empty()) {
    return fail_in(*file, ErrorKind::bad_input,
                   fmt::format("the {} file has no triangles: points and lines cannot be streamed", name(*format)));
  }
  if (options.keep_polygons && result->polygons.face_count() == 0) result->polygons = polygon_mesh(result->mesh);
  result->format = *format;
  if (extension && *extension != *format) {
    result->warnings.push_back(
        fmt::format("The file is called {}, but its content is {}.", file->path().extension().string(), name(*format)));
  }
  return result;
}

// Libraries throw: nothing of that may leave this room.
template <class Open>
Result<ImportedMesh> import_guarded(Open open, const std::filesystem::path& path, const ImportOptions& options) {
  ImportOptions limited = options;
  limited.max_vertices = std::min(options.max_vertices, kMaxVertices);
  limited.max_triangles = std::min(options.max_triangles, kMaxTriangles);
  try {
    return import_unguarded(open(), limited);
  } catch (const std::bad_alloc&) {
    return fail(ErrorKind::limit, path.string() + ": not enough memory for this mesh");
  } catch (const std::exception& problem) {
    return fail(ErrorKind::bad_input, fmt::format("{}: cannot be read: {}", path.string(), problem.what()));
  }
}

}  // namespace

std::string_view name(MeshFormat format) {
  switch (format) {
    case MeshFormat::ply: return "PLY";
    case MeshFormat::stl: return "STL";
    case MeshFormat::obj: return "OBJ";
    case MeshFormat::off: return "OFF";
    case MeshFormat::gltf: return "glTF";
    case MeshFormat::glb: return "GLB";
  }
  return "unknown";
}

Result<ImportedMesh> import_mesh(const std::filesystem::path& path, const ImportOptions& options) {
  return import_guarded([&] { return InputFile::read(path); }, path, options);
}

Result<ImportedMesh> import_mesh_from_memory(std::string_view bytes, const std::filesystem::path& path,
                                             const ImportOptions& options) {
  return import_guarded([&] { return InputFile::from_memory(bytes, path); }, path, options);
}

}  // namespace fanstream
