#include "server/store/model_build.h"

#include <algorithm>
#include <array>

#include "common/import/mesh_import.h"

namespace fanstream {

Result<ModelBuild> build_model(const std::filesystem::path& path, const BuildOptions& options) {
  const auto report = [&](std::string_view stage) {
    if (options.progress) options.progress(stage, 0.0);
  };
  report("import");
  Result<ImportedMesh> imported = import_mesh(path);
  if (!imported) return tl::unexpected(imported.error());
  report("clean");
  CleanedMesh cleaned = clean_mesh(std::move(imported->mesh), std::move(imported->source_faces));
  if (cleaned.mesh.triangles.empty()) {
    return fail(ErrorKind::bad_input,
                path.string() + ": no triangle is left after cleaning: every one of them is degenerate");
  }
  BuildOptions with_faces = options;
  with_faces.source_faces = cleaned.source_faces;
  Result<BuiltAsset> built = build_asset(cleaned.mesh, with_faces);
  if (!built) return tl::unexpected(with_context(built.error(), path.string()));
  return ModelBuild{std::move(*built), cleaned.report, std::move(imported->warnings)};
}

double overall_fraction(std::string_view stage, double fraction) {
  struct Stage {
    std::string_view name;
    double begin, end;
  };
  // As the times were divided when the large dragon was built, on two cores.
  static constexpr std::array<Stage, 7> kStages{{{"import", 0.0, 0.02},
                                                 {"clean", 0.02, 0.05},
                                                 {"simplify", 0.05, 0.52},
                                                 {"order by error", 0.52, 0.65},
                                                 {"learn statistics", 0.65, 0.73},
                                                 {"encode", 0.73, 0.81},
                                                 {"measure errors", 0.81, 1.0}}};
  const auto* found = std::find_if(kStages.begin(), kStages.end(), [&](const Stage& s) { return s.name == stage; });
  if (found == kStages.end()) return 0.0;
  return found->begin + (found->end - found->begin) * std::clamp(fraction, 0.0, 1.0);
}

}  // namespace fanstream
