#include "server/store/asset_folder.h"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <optional>
#include <system_error>

#include "common/support/atomic_file.h"

namespace fanstream {
namespace {

constexpr std::size_t kKeyDigits = 16;
constexpr std::size_t kLongName = 200;  // file systems take 255 bytes, with key, extension and temporary suffix
constexpr std::string_view kTemporaryMark = ".fan.tmp-";

std::string file_prefix(const std::string& model) {
  if (model.size() <= kLongName) return model + "-";
  return fmt::format("{}~{:016x}-", model.substr(0, kLongName / 2), XXH3_64bits(model.data(), model.size()));
}

bool is_key(std::string_view text) {
  return text.size() == kKeyDigits && text.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

// The process that was writing the temporary file "<asset>.fan.tmp-<process>-<number>".
std::optional<pid_t> writer_of(const std::string& file_name) {
  const std::size_t mark = file_name.rfind(kTemporaryMark);
  if (mark == std::string::npos) return {};
  pid_t process = 0;
  const char* begin = file_name.data() + mark + kTemporaryMark.size();
  const auto parsed = std::from_chars(begin, file_name.data() + file_name.size(), process);
  if (parsed.ec != std::errc() || process <= 0) return {};
  return process;
}

}  // namespace

Result<AssetFolder> AssetFolder::open(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (!error && !std::filesystem::is_directory(folder, error) && !error)
    error = std::make_error_code(std::errc::not_a_directory);
  if (error) {
    return fail(ErrorKind::io, "store " + folder.string() + ": cannot be made: " + error.message() +
                                   "; choose another folder with --store");
  }
  AssetFolder opened(folder);
  opened.remove_leftovers();
  const std::filesystem::path probe = folder / fmt::format("probe.fan.tmp-{}-0", ::getpid());
  const std::array<std::byte, 1> byte{};
  if (Result<void> written = write_file_atomically(probe, std::span<const std::byte>(byte)); !written) {
    return tl::unexpected(Error{ErrorKind::io, "store " + folder.string() + ": cannot be written to (" +
                                                   written.error().message + "); choose another folder with --store"});
  }
  std::filesystem::remove(probe, error);
  return opened;
}

void AssetFolder::remove_leftovers() const {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder_, error)) {
    const std::optional<pid_t> writer = writer_of(entry.path().filename().string());
    // This process has written nothing yet: what bears its number is of an earlier one, as is common in containers.
    if (!writer || (*writer != ::getpid() && (::kill(*writer, 0) == 0 || errno != ESRCH))) continue;
    std::error_code ignored;
    std::filesystem::remove(entry.path(), ignored);
  }
}

std::filesystem::path AssetFolder::file_of(const std::string& model, const std::string& key) const {
  return folder_ / (file_prefix(model) + key.substr(0, kKeyDigits) + ".fan");
}

void AssetFolder::remove_superseded(const std::string& model, const std::string& key) const {
  const std::string prefix = file_prefix(model);
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder_, error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(prefix) || !name.ends_with(".fan") || name.size() != prefix.size() + kKeyDigits + 4) continue;
    const std::string_view found = std::string_view(name).substr(prefix.size(), kKeyDigits);
    if (!is_key(found) || found == std::string_view(key).substr(0, kKeyDigits)) continue;
    std::error_code ignored;
    std::filesystem::remove(entry.path(), ignored);
  }
}

}  // namespace fanstream
