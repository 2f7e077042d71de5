#include "tests/bench/cleaned_mesh.h"

#include "common/import/mesh_cleaner.h"
#include "common/import/mesh_import.h"

namespace fanstream::bench {

Result<TriangleMesh> cleaned_mesh(const std::filesystem::path& file) {
  Result<ImportedMesh> imported = import_mesh(file);
  if (!imported) return tl::unexpected(imported.error());
  TriangleMesh mesh = clean_mesh(std::move(imported->mesh)).mesh;
  if (mesh.triangles.empty()) return fail(ErrorKind::bad_input, file.string() + ": no triangles left after cleaning");
  return mesh;
}

}  // namespace fanstream::bench
