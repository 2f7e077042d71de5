// One model file into one asset: import, clean-up and building in a row, as `fanstream-server build` and the store do
// it.
#pragma once

#include <filesystem>

#include "common/import/mesh_cleaner.h"
#include "server/build/asset_builder.h"

namespace fanstream {

struct ModelBuild {
  BuiltAsset asset;
  RepairReport repairs;
  std::vector<std::string> warnings;  // of the import
};

// options.progress also gets the stages "import" and "clean". Errors begin with the path. Deterministic. Thread safety:
// may run on several threads at once.
Result<ModelBuild> build_model(const std::filesystem::path& path, const BuildOptions& options);

// The share of a whole build that is done, from what BuildOptions::progress is told. Rises from 0 to 1; an estimate.
double overall_fraction(std::string_view stage, double fraction);

}  // namespace fanstream
