// What an asset in the store was made of: when this changes, it is built again.
#pragma once

#include <filesystem>
#include <string>

#include "common/support/result.h"
#include "server/build/asset_builder.h"

namespace fanstream {

// 32 hexadecimal digits (XXH3-128) over the content of the file, over the names and contents of the buffers that a
// .gltf file refers to, over every option that changes the asset, and over the versions of builder and format. Reads
// the file in pieces. Fails (not_found, io) if it cannot be read; a buffer that is missing counts as such, and import
// will tell.
Result<std::string> source_key(const std::filesystem::path& path, const BuildOptions& options);

}  // namespace fanstream
