#include "common/asset/asset_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>

namespace fanstream {
namespace {

constexpr std::array<char, 4> kFirstBytes{'F', 'S', 'A', 'N'};

Error system_failure(const std::string& name, int error) {
  if (error == ENOENT || error == ENOTDIR) return {ErrorKind::not_found, name + ": no such file; check the path"};
  const std::string reason = std::error_code(error, std::generic_category()).message();
  return {ErrorKind::io,
          fmt::format("{}: cannot be read: {}{}", name, reason, error == EACCES ? "; check its permissions" : "")};
}

// Closes itself; errors are of no interest for a file that is only read.
struct Descriptor {
  int value = -1;
  explicit Descriptor(const char* path) : value(::open(path, O_RDONLY | O_CLOEXEC)) {}
  ~Descriptor() {
    if (value >= 0) ::close(value);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
};

}  // namespace

AssetFile::~AssetFile() {
  if (mapping_ != nullptr) ::munmap(mapping_, bytes_.size());
}

Result<std::shared_ptr<const AssetFile>> AssetFile::open(const std::filesystem::path& path) {
  std::shared_ptr<AssetFile> asset(new AssetFile);
  asset->name_ = path.string();
  struct stat status {};
  // Looked at before it is opened: opening a pipe would wait for its other end.
  if (::stat(path.c_str(), &status) != 0) return tl::unexpected(system_failure(asset->name_, errno));
  if (S_ISDIR(status.st_mode)) return fail(ErrorKind::io, asset->name_ + ": is a directory, not an asset file");
  if (!S_ISREG(status.st_mode))
    return fail(ErrorKind::io, asset->name_ + ": not a regular file, so it cannot be mapped");
  const Descriptor file(path.c_str());
  if (file.value < 0 || ::fstat(file.value, &status) != 0) return tl::unexpected(system_failure(asset->name_, errno));
  if (const auto size = static_cast<std::size_t>(status.st_size); size > 0) {
    void* mapping = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file.value, 0);
    if (mapping == MAP_FAILED) return tl::unexpected(system_failure(asset->name_, errno));
    asset->mapping_ = mapping;
    asset->bytes_ = {static_cast<const std::byte*>(mapping), size};
  }
  // Once more, now that it is mapped: a file that is still being written shows here rather than as a crash later.
  struct stat again {};
  if (::fstat(file.value, &again) != 0) return tl::unexpected(system_failure(asset->name_, errno));
  if (again.st_size != status.st_size) {
    return fail(ErrorKind::io, asset->name_ + ": changes its size while it is read; try again when it is written");
  }
  if (Result<void> read = asset->read(); !read) return tl::unexpected(read.error());
  return asset;
}

Result<std::shared_ptr<const AssetFile>> AssetFile::from_memory(std::vector<std::byte> bytes, std::string name) {
  std::shared_ptr<AssetFile> asset(new AssetFile);
  asset->name_ = std::move(name);
  asset->owned_ = std::move(bytes);
  asset->bytes_ = asset->owned_;
  if (Result<void> read = asset->read(); !read) return tl::unexpected(read.error());
  return asset;
}

// What is no asset at all is told apart from a damaged one.
Result<void> AssetFile::check_start() const {
  if (bytes_.empty()) return fail(ErrorKind::bad_input, name_ + ": is empty (0 bytes); build the asset again");
  const std::size_t comparable = std::min(bytes_.size(), kFirstBytes.size());
  if (std::memcmp(bytes_.data(), kFirstBytes.data(), comparable) != 0) {
    return fail(ErrorKind::bad_input, name_ +
                                          ": not a Fanstream asset (its first bytes are not FSAN); make one with "
                                          "fanstream-server build");
  }
  return {};
}

Result<void> AssetFile::read() {
  if (Result<void> start = check_start(); !start) return start;
  Result<AssetPreamble> preamble = read_preamble(bytes_, name_);
  if (!preamble) return tl::unexpected(preamble.error());
  preamble_ = *preamble;
  if (bytes_.size() < preamble_.file_bytes()) {
    return fail(ErrorKind::bad_input, fmt::format("{}: cut short at byte {} of {}; copy or build the asset again",
                                                  name_, bytes_.size(), preamble_.file_bytes()));
  }
  if (bytes_.size() > preamble_.file_bytes()) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: {} bytes follow the asset's end at byte {}; copy or build it again", name_,
                            bytes_.size() - preamble_.file_bytes(), preamble_.file_bytes()));
  }
  if (const auto block = first_damaged_block(); block || content_digest(content()) != preamble_.digest) {
    return tl::unexpected(damage(block));
  }
  Result<AssetHead> head = read_head(this->head(), name_);
  if (!head) return tl::unexpected(head.error());
  Result<AssetIndex> index = read_whole_index(bytes_, preamble_, *head, name_);
  if (!index) return tl::unexpected(index.error());
  head_ = std::make_shared<const AssetHead>(std::move(*head));
  index_ = std::make_shared<const AssetIndex>(std::move(*index));
  return {};
}

std::span<const std::byte> AssetFile::segment(std::uint32_t cell, std::uint32_t segment) const {
  return bytes_.subspan(index_->piece_offset(cell, segment), index_->piece_bytes(cell, segment));
}

std::span<const std::byte> AssetFile::content() const {
  return bytes_.subspan(kPreambleBytes, preamble_.section_bytes() - kPreambleBytes);
}

std::optional<std::uint64_t> AssetFile::first_damaged_block() const {
  ByteReader checksums(bytes_.subspan(preamble_.section_bytes()));
  for (std::uint64_t block = 0; block < preamble_.block_count(); ++block) {
    const auto rest = content().subspan(block * kBlockBytes);
    if (block_checksum(rest.first(std::min(rest.size(), kBlockBytes))) != checksums.u32()) return block;
  }
  return {};
}

// Says where the damage lies; of the segments only a block is known.
Error AssetFile::damage(std::optional<std::uint64_t> block) const {
  std::string where = "in the digest, bytes 32 to 47";
  if (block) {
    const std::uint64_t begin = kPreambleBytes + *block * kBlockBytes;
    const std::uint64_t end = std::min(begin + kBlockBytes, preamble_.section_bytes());
    const std::uint64_t index_begin = preamble_.head_bytes;
    const std::uint64_t segments_begin = index_begin + preamble_.index_bytes;
    std::string sections;
    if (begin < index_begin) sections += ", the head";
    if (begin < segments_begin && end > index_begin) sections += ", the cell table";
    if (end > segments_begin) sections += ", the segments";
    where = fmt::format("in bytes {} to {} ({}) or their checksum at byte {}", begin, end - 1, sections.substr(2),
                        preamble_.section_bytes() + 4 * *block);
  }
  return {ErrorKind::bad_input, name_ + ": damaged " + where + "; copy or build the asset again"};
}

std::string text_of(const Digest& digest) {
  std::string text;
  for (const std::uint8_t byte : digest) text += fmt::format("{:02x}", byte);
  return text;
}

}  // namespace fanstream
