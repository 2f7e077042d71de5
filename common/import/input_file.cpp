#include "common/import/input_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace fanstream {
namespace {

class Descriptor {
 public:
  explicit Descriptor(int value) : value_(value) {}
  ~Descriptor() {
    if (value_ >= 0) ::close(value_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int value() const { return value_; }

 private:
  int value_;
};

tl::unexpected<Error> fail_with_errno(const std::filesystem::path& path, std::string_view what) {
  const int code = errno;
  const ErrorKind kind = code == ENOENT || code == ENOTDIR ? ErrorKind::not_found : ErrorKind::io;
  return fail(kind, fmt::format("{}: {}: {}", path.string(), what, std::strerror(code)));
}

tl::unexpected<Error> fail_empty(const std::filesystem::path& path) {
  return fail(ErrorKind::bad_input, fmt::format("{}: the file is empty", path.string()));
}

}  // namespace

Result<InputFile> InputFile::from_memory(std::string_view bytes, const std::filesystem::path& path) {
  if (bytes.empty()) return fail_empty(path);
  InputFile result;
  result.path_ = path;
  result.size_bytes_ = bytes.size();
  result.storage_ = std::make_unique_for_overwrite<char[]>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), result.storage_.get());
  return result;
}

Result<InputFile> InputFile::read(const std::filesystem::path& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.value() < 0) return fail_with_errno(path, "cannot be opened");
  struct stat status {};
  if (::fstat(file.value(), &status) != 0) return fail_with_errno(path, "cannot be examined");
  if (!S_ISREG(status.st_mode)) return fail(ErrorKind::io, fmt::format("{}: is not a regular file", path.string()));
  if (status.st_size == 0) return fail_empty(path);
  InputFile result;
  result.path_ = path;
  result.size_bytes_ = static_cast<std::size_t>(status.st_size);
  result.storage_ = std::make_unique_for_overwrite<char[]>(result.size_bytes_);
  std::size_t done = 0;
  while (done < result.size_bytes_) {
    const std::size_t wanted = std::min(result.size_bytes_ - done, std::size_t{1} << 30);
    const ssize_t got = ::read(file.value(), result.storage_.get() + done, wanted);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return fail_with_errno(path, fmt::format("byte {}: cannot be read", done));
    if (got == 0) {
      return fail(ErrorKind::io,
                  fmt::format("{}: byte {}: the file was shortened while being read", path.string(), done));
    }
    done += static_cast<std::size_t>(got);
  }
  return result;
}

tl::unexpected<Error> fail_at_byte(const InputFile& file, std::size_t offset, std::string_view what) {
  return fail(ErrorKind::bad_input, fmt::format("{}: byte {}: {}", file.name(), offset, what));
}

tl::unexpected<Error> fail_in(const InputFile& file, ErrorKind kind, std::string_view what) {
  return fail(kind, fmt::format("{}: {}", file.name(), what));
}

}  // namespace fanstream
