// Which models a folder holds, and what they are called.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/support/result.h"

namespace fanstream {

struct ModelFile {
  std::string name;  // what clients ask for
  std::filesystem::path path;
  bool is_asset = false;  // a ready .fan file
};

struct ModelFolder {
  std::vector<ModelFile> models;      // sorted by name
  std::vector<std::string> warnings;  // files that look like models and cannot be offered, each a whole sentence
};

// The files of a folder (not below it; links are followed, hidden files are not looked at) with one of the extensions
// ply, stl, obj, off, gltf, glb and fan in any case. A model is called like its file without the extension; files that
// would share a name keep theirs. Fails (not_found, io, limit) if the folder cannot be read or holds more than
// kMaxCatalogueEntries models.
Result<ModelFolder> list_models(const std::filesystem::path& folder);

}  // namespace fanstream
