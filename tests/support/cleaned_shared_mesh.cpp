#include "tests/support/cleaned_shared_mesh.h"

#include <stdexcept>

#include "common/import/mesh_cleaner.h"
#include "common/import/mesh_import.h"
#include "tests/support/shared_data.h"

namespace fanstream::testing {

std::optional<TriangleMesh> cleaned_shared_mesh(const std::string& file_name) {
  const std::filesystem::path path = shared_mesh(file_name);
  if (path.empty()) return std::nullopt;
  auto imported = import_mesh(path);
  if (!imported) throw std::runtime_error(imported.error().message);
  return clean_mesh(std::move(imported->mesh)).mesh;
}

}  // namespace fanstream::testing
