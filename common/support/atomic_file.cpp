#include "common/support/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <system_error>

namespace fanstream {
namespace {

Result<void> io_failure(const std::filesystem::path& path, int error) {
  const char* advice = error == ENOSPC || error == EDQUOT ? "; free some space or write elsewhere"
                       : error == EACCES || error == EPERM || error == EROFS
                           ? "; check the permissions or write elsewhere"
                       : error == ENOENT || error == ENOTDIR ? "; create the directory first"
                                                             : "";
  return fail(ErrorKind::io, fmt::format("{}: cannot write: {}{}", path.string(),
                                         std::error_code(error, std::generic_category()).message(), advice));
}

// 0, or errno.
int write_all(int file, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(file, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return 0;
}

// Closes in any case; 0, or the errno of the first failure.
int write_and_close(int file, std::span<const std::byte> bytes, bool flush) {
  int error = write_all(file, bytes);
  if (error == 0 && flush && ::fsync(file) != 0) error = errno;
  if (::close(file) != 0 && error == 0) error = errno;
  return error;
}

// The rename itself must survive a crash. Some file systems cannot flush a folder: no reason to fail.
int flush_folder_of(const std::filesystem::path& file) {
  const std::filesystem::path parent = file.has_parent_path() ? file.parent_path() : ".";
  const int folder = ::open(parent.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return errno == EACCES ? 0 : errno;  // a folder may be writable and not readable
  const int error = ::fsync(folder) != 0 && errno != EINVAL && errno != EROFS ? errno : 0;
  ::close(folder);
  return error;
}

Result<void> write_in_place(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  if (file < 0) return io_failure(path, errno);
  const int error = write_and_close(file, bytes, false);
  return error == 0 ? Result<void>() : io_failure(path, error);
}

}  // namespace

Result<void> write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  struct stat status {};
  const bool exists = ::stat(path.c_str(), &status) == 0;
  if (exists && S_ISDIR(status.st_mode)) return io_failure(path, EISDIR);
  if (exists && !S_ISREG(status.st_mode)) return write_in_place(path, bytes);

  std::error_code ignored;
  const std::filesystem::path target = exists ? std::filesystem::canonical(path, ignored) : path;
  if (target.empty()) return io_failure(path, ENOENT);
  static std::atomic<unsigned> serial{0};
  std::string temporary;
  int file = -1;
  // One of that name may be left of a process that had this one's number and was killed.
  constexpr int kMostLeftovers = 1000;
  for (int i = 0; i < kMostLeftovers && file < 0; ++i) {
    temporary = fmt::format("{}.tmp-{}-{}", target.string(), ::getpid(), ++serial);
    file = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file < 0 && errno != EEXIST) break;
  }
  if (file < 0) return io_failure(path, errno);
  int error = exists && ::fchmod(file, status.st_mode & 07777U) != 0 ? errno : 0;
  if (const int written = write_and_close(file, bytes, true); error == 0) error = written;
  if (error == 0 && ::rename(temporary.c_str(), target.c_str()) != 0) error = errno;
  if (error != 0) {
    ::unlink(temporary.c_str());
    return io_failure(path, error);
  }
  if (const int flushed = flush_folder_of(target); flushed != 0) return io_failure(path, flushed);
  return {};
}

Result<void> write_file_atomically(const std::filesystem::path& path, std::span<const std::uint8_t> bytes) {
  return write_file_atomically(path, std::as_bytes(bytes));
}

}  // namespace fanstream
