// A mesh file as the builder wants it.
#pragma once

#include <filesystem>

#include "common/mesh/triangle_mesh.h"
#include "common/support/result.h"

namespace fanstream::bench {

// Reads a mesh file and cleans it. Fails as import_mesh does, and (bad_input) where nothing is left.
Result<TriangleMesh> cleaned_mesh(const std::filesystem::path& file);

}  // namespace fanstream::bench
