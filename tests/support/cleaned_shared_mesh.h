// The shared meshes as the builder wants them.
#pragma once

#include <optional>
#include <string>

#include "common/mesh/triangle_mesh.h"

namespace fanstream::testing {

// One of the shared meshes (shared_data.h), imported and cleaned; nothing where it is absent. Throws what the importer
// says where it fails.
std::optional<TriangleMesh> cleaned_shared_mesh(const std::string& file_name);

}  // namespace fanstream::testing
