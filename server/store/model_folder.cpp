#include "server/store/model_folder.h"

#include <algorithm>
#include <array>
#include <map>
#include <system_error>

#include "protocol/limits.h"
#include "protocol/wire.h"

namespace fanstream {
namespace {

constexpr std::array<std::string_view, 7> kExtensions{".ply", ".stl", ".obj", ".off", ".gltf", ".glb", ".fan"};

std::string lower_case_extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return extension;
}

// Files whose stems meet take their whole names, and so does whatever such a whole name meets then.
void settle_names(std::vector<ModelFile>& models) {
  for (bool changed = true; changed;) {
    changed = false;
    std::map<std::string, int> uses;
    for (const ModelFile& model : models) ++uses[model.name];
    for (ModelFile& model : models) {
      const std::string whole = model.path.filename().string();
      if (uses[model.name] < 2 || model.name == whole) continue;
      model.name = whole;
      changed = true;
    }
  }
}

}  // namespace

Result<ModelFolder> list_models(const std::filesystem::path& folder) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(folder, error);
  if (!std::filesystem::exists(status)) {
    return fail(ErrorKind::not_found, folder.string() + ": no such folder; give the folder that the models are in");
  }
  if (!std::filesystem::is_directory(status)) {
    return fail(ErrorKind::usage, folder.string() + ": is a file; give the folder that the models are in");
  }
  ModelFolder found;
  std::filesystem::directory_iterator entries(folder, error);
  for (; !error && entries != std::filesystem::directory_iterator(); entries.increment(error)) {
    const std::filesystem::path& path = entries->path();
    const std::string extension = lower_case_extension(path);
    if (std::find(kExtensions.begin(), kExtensions.end(), extension) == kExtensions.end()) continue;
    if (path.filename().string().starts_with(".")) continue;
    std::error_code unreadable;
    if (std::filesystem::is_directory(path, unreadable)) continue;
    const std::string name = path.filename().string();
    if (!is_printable_utf8(name) || name.size() > kMaxNameBytes) {
      found.warnings.push_back("A file in " + folder.string() +
                               " is left out, because its name is not printable UTF-8; rename it.");
      continue;
    }
    if (!std::filesystem::is_regular_file(path, unreadable)) {
      found.warnings.push_back(path.string() + " is left out: it is not a regular file, or a link that leads nowhere.");
      continue;
    }
    found.models.push_back({path.stem().string(), path, extension == ".fan"});
  }
  if (error)
    return fail(ErrorKind::io, folder.string() + ": cannot be read: " + error.message() + "; check its permissions");
  if (found.models.size() > kMaxCatalogueEntries) {
    return fail(ErrorKind::limit, folder.string() + ": " + std::to_string(found.models.size()) +
                                      " models, a server offers at most " + std::to_string(kMaxCatalogueEntries));
  }
  settle_names(found.models);
  std::sort(found.models.begin(), found.models.end(),
            [](const ModelFile& a, const ModelFile& b) { return a.name < b.name; });
  return found;
}

}  // namespace fanstream
