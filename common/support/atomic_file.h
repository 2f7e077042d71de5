// Files that are either whole or not there.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

#include "common/support/result.h"

namespace fanstream {

// Writes to a temporary name beside `path` ("<path>.tmp-<process>-<number>"), flushes it, renames it over `path` and
// flushes the folder: whatever fails, and even if the machine stops, a file that was there before is untouched or
// replaced as a whole, and nothing is left behind unless the process is killed. A path that exists and is no regular
// file (a pipe, /dev/stdout) is written to directly. A symbolic link is followed. Fails (io) naming the path, the
// system's reason and what to do about it. Thread safe.
Result<void> write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes);
Result<void> write_file_atomically(const std::filesystem::path& path, std::span<const std::uint8_t> bytes);

}  // namespace fanstream
