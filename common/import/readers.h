// One reader per format. Each takes the file's bytes as they are and sets everything of the result but `format`; what
// import_mesh() promises about errors and limits holds for each. Whether there are triangles at all is left to the
// caller.
#pragma once

#include "common/import/input_file.h"
#include "common/import/mesh_import.h"

namespace fanstream {

Result<ImportedMesh> read_ply(const InputFile& file, const ImportOptions& options);
Result<ImportedMesh> read_stl(const InputFile& file, const ImportOptions& options);
Result<ImportedMesh> read_obj(const InputFile& file, const ImportOptions& options);
Result<ImportedMesh> read_off(const InputFile& file, const ImportOptions& options);
Result<ImportedMesh> read_gltf(const InputFile& file, const ImportOptions& options);  // JSON and GLB

// Whether the file is a binary STL by its size, which its facet count determines; and a text STL by its words.
bool looks_like_binary_stl(std::string_view bytes);
bool looks_like_text_stl(std::string_view bytes);

}  // namespace fanstream
