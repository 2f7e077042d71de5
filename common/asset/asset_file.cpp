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
constexpr std::uint64_t kVerticesWithoutQuestion = 1U << 16U;
constexpr std::uint64_t kMostVerticesPerByte = 64;

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

bool AssetFile::believable(std::uint64_t vertices) const {
  return vertices <= kVerticesWithoutQuestion + kMostVerticesPerByte * bytes_.size();
}

Result<void> AssetFile::read() {
  if (Result<void> start = check_start(); !start) return start;
  Result<AssetPreamble> preamble = read_preamble(bytes_, name_);
  if (!preamble) return tl::unexpected(preamble.error());
  preamble_ = *preamble;
  if (bytes_.size() < preamble_.total_bytes()) {
    return fail(ErrorKind::bad_input, fmt::format("{}: cut short at byte {} of {}; copy or build the asset again",
                                                  name_, bytes_.size(), preamble_.total_bytes()));
  }
  if (bytes_.size() > preamble_.total_bytes()) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: {} bytes follow the asset's end at byte {}; copy or build it again", name_,
                            bytes_.size() - preamble_.total_bytes(), preamble_.total_bytes()));
  }
  if (content_digest(bytes_.subspan(kPreambleBytes)) != preamble_.digest) return tl::unexpected(damage());
  Result<AssetHead> head = read_head(this->head(), name_);
  if (!head) return tl::unexpected(head.error());
  // Memory is taken by vertex; nothing near an eighth of a bit for each has ever been seen (a flat grid takes 5 bits).
  if (!believable(head->vertex_count)) {
    return fail(ErrorKind::limit,
                fmt::format("{}: {} vertices in {} bytes are not believed; the asset is forged or damaged", name_,
                            head->vertex_count, bytes_.size()));
  }
  Result<AssetIndex> index = read_index(this->index(), preamble_, *head, name_);
  if (!index) return tl::unexpected(index.error());
  head_ = std::make_shared<const AssetHead>(std::move(*head));
  index_ = std::make_shared<const AssetIndex>(std::move(*index));
  return {};
}

std::span<const std::byte> AssetFile::segment(std::uint32_t cell, std::uint32_t segment) const {
  const SegmentEntry& entry = index_->segments[index_->cells[cell].first_segment + segment];
  return bytes_.subspan(entry.offset, entry.size_bytes);
}

// The digest is wrong: says where the damage lies as far as the parts' own checks can tell.
Error AssetFile::damage() const {
  const auto error = [this](const std::string& where) {
    return Error{ErrorKind::bad_input, name_ + ": damaged " + where + "; copy or build the asset again"};
  };
  const std::string in_head = fmt::format("in the digest or the head, bytes 32 to {}", preamble_.head_bytes - 1);
  const Result<AssetHead> head = read_head(this->head(), "the head");
  if (!head) return error(in_head + " (" + head.error().message + ")");
  if (!believable(head->vertex_count)) return error(in_head);
  const Result<AssetIndex> index = read_index(this->index(), preamble_, *head, "the index");
  if (!index) {
    return error(fmt::format("before byte {}, in the head or the cell table ({})",
                             preamble_.head_bytes + preamble_.index_bytes, index.error().message));
  }
  for (std::size_t c = 0; c < index->cells.size(); ++c) {
    for (std::uint32_t s = 0; s < index->cells[c].segment_count; ++s) {
      const SegmentEntry& entry = index->segments[index->cells[c].first_segment + s];
      if (segment_checksum(bytes_.subspan(entry.offset, entry.size_bytes)) == entry.checksum || entry.size_bytes == 0)
        continue;
      return error(fmt::format("in cell {} segment {}, bytes {} to {}", c, s, entry.offset,
                               entry.offset + entry.size_bytes - 1));
    }
  }
  return error(fmt::format("in the digest, the head or the cell table, bytes 32 to {}",
                           preamble_.head_bytes + preamble_.index_bytes - 1));
}

std::string text_of(const Digest& digest) {
  std::string text;
  for (const std::uint8_t byte : digest) text += fmt::format("{:02x}", byte);
  return text;
}

}  // namespace fanstream
