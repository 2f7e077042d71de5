// Files that are either whole or not there.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "common/support/result.h"

namespace fanstream {

// Writes to a temporary name beside `path`, flushes to disk and renames over `path`: whatever fails, a file that was
// there before is untouched and nothing is left behind. A path that exists and is no regular file (a pipe, /dev/stdout)
// is written to directly. A symbolic link is followed. Fails (io) naming the path and the system's reason.
Result<void> write_file_atomically(const std::filesystem::path& path, std::span<const std::uint8_t> bytes);

}  // namespace fanstream
