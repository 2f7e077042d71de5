// The real meshes that lie beside the repository on some machines (../shared/data); tests skip where they are absent.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace fanstream::testing {

inline std::filesystem::path shared_data_folder() {
  const char* given = std::getenv("FANSTREAM_DATA");
  return given != nullptr ? std::filesystem::path(given)
                          : std::filesystem::path(FANSTREAM_SOURCE_DIR "/../shared/data");
}

// The path of one of the shared meshes, or an empty path where it is absent.
inline std::filesystem::path shared_mesh(const std::string& file_name) {
  std::error_code ignored;
  const std::filesystem::path path = shared_data_folder() / file_name;
  return std::filesystem::exists(path, ignored) ? path : std::filesystem::path();
}

}  // namespace fanstream::testing
