// The bytes of one mesh file, and errors that name places in it.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "common/support/result.h"

namespace fanstream {

// Read once into memory, not mapped: a file that someone shortens meanwhile must not kill the server.
class InputFile {
 public:
  // Regular files only: a pipe or device could block or never end. An empty file is an error.
  static Result<InputFile> read(const std::filesystem::path& path);
  // A copy of bytes that `path` is said to hold.
  static Result<InputFile> from_memory(std::string_view bytes, const std::filesystem::path& path);

  std::string_view bytes() const { return {storage_.get(), size_bytes_}; }
  const std::filesystem::path& path() const { return path_; }
  std::string name() const { return path_.string(); }

 private:
  std::filesystem::path path_;
  std::unique_ptr<char[]> storage_;
  std::size_t size_bytes_ = 0;
};

// "bunny.ply: byte 812: what".
tl::unexpected<Error> fail_at_byte(const InputFile& file, std::size_t offset, std::string_view what);
// "bunny.ply: what".
tl::unexpected<Error> fail_in(const InputFile& file, ErrorKind kind, std::string_view what);

}  // namespace fanstream
