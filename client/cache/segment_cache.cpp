#include "client/cache/segment_cache.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <cstring>

#include "common/support/atomic_file.h"
#include "protocol/limits.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace fanstream {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kFileHeaderBytes = 24;    // magic, digest
constexpr std::size_t kRecordHeaderBytes = 25;  // kind, cell, segment, size, checksum of the content, of these fields
constexpr std::array<char, 8> kMagic = {'F', 'S', 'N', 'C', 'A', 'C', 'H', '1'};
constexpr std::size_t kPendingBytes = 64 * 1024;
constexpr const char* kExtension = ".fancache";

void put_number(std::byte* to, std::uint64_t value, int count) {
  for (int i = 0; i < count; ++i) to[i] = static_cast<std::byte>(value >> (8 * i));
}

std::uint64_t get_number(const std::byte* from, int count) {
  std::uint64_t value = 0;
  for (int i = 0; i < count; ++i) value |= std::to_integer<std::uint64_t>(from[i]) << (8 * i);
  return value;
}

std::string hex_of(std::span<const std::uint8_t> bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) text += fmt::format("{:02x}", byte);
  return text;
}

struct RecordHeader {
  std::uint8_t kind = 0;
  std::uint32_t cell = 0, segment = 0, size_bytes = 0;
  std::uint64_t checksum = 0;
};

std::uint32_t header_checksum(const std::byte* header) {
  return static_cast<std::uint32_t>(XXH3_64bits(header, kRecordHeaderBytes - 4));
}

std::array<std::byte, kRecordHeaderBytes> pack(const RecordHeader& record) {
  std::array<std::byte, kRecordHeaderBytes> bytes{};
  bytes[0] = static_cast<std::byte>(record.kind);
  put_number(bytes.data() + 1, record.cell, 4);
  put_number(bytes.data() + 5, record.segment, 4);
  put_number(bytes.data() + 9, record.size_bytes, 4);
  put_number(bytes.data() + 13, record.checksum, 8);
  put_number(bytes.data() + 21, header_checksum(bytes.data()), 4);
  return bytes;
}

std::optional<RecordHeader> unpack(const std::byte* bytes) {
  if (get_number(bytes + 21, 4) != header_checksum(bytes)) return std::nullopt;
  const RecordHeader record{std::to_integer<std::uint8_t>(bytes[0]),
                            static_cast<std::uint32_t>(get_number(bytes + 1, 4)),
                            static_cast<std::uint32_t>(get_number(bytes + 5, 4)),
                            static_cast<std::uint32_t>(get_number(bytes + 9, 4)), get_number(bytes + 13, 8)};
  const bool possible = record.kind >= 1 && record.kind <= 3 && record.cell < kMaxCells &&
                        record.segment < kMaxSegmentsPerCell && record.size_bytes <= kMaxHeadBytes;
  return possible ? std::optional(record) : std::nullopt;
}

// False on errors, also where the file ends before.
bool read_exactly(int file, std::span<std::byte> to, std::uint64_t offset) {
  while (!to.empty()) {
    const ssize_t size = ::pread(file, to.data(), to.size(), static_cast<off_t>(offset));
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return false;
    to = to.subspan(static_cast<std::size_t>(size));
    offset += static_cast<std::uint64_t>(size);
  }
  return true;
}

bool write_exactly(int file, std::span<const std::byte> from, std::uint64_t offset) {
  while (!from.empty()) {
    const ssize_t size = ::pwrite(file, from.data(), from.size(), static_cast<off_t>(offset));
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return false;
    from = from.subspan(static_cast<std::size_t>(size));
    offset += static_cast<std::uint64_t>(size);
  }
  return true;
}

struct OtherFile {
  fs::path path;
  fs::file_time_type used;
  std::uint64_t size_bytes = 0;
};

// The files of all assets but this one, those used longest ago first.
std::vector<OtherFile> other_files(const fs::path& folder, const fs::path& own) {
  std::vector<OtherFile> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (entry->path().extension() != kExtension || entry->path() == own) continue;
    std::error_code gone;
    const OtherFile file{entry->path(), entry->last_write_time(gone), entry->file_size(gone)};
    if (!gone) files.push_back(file);
  }
  std::sort(files.begin(), files.end(), [](const OtherFile& a, const OtherFile& b) { return a.used < b.used; });
  return files;
}

// Not while another process has it open.
bool remove_if_unused(const fs::path& path) {
  const int file = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (file < 0) return false;
  const bool removed = ::flock(file, LOCK_EX | LOCK_NB) == 0 && ::unlink(path.c_str()) == 0;
  ::close(file);
  return removed;
}

// Among the processes that use the folder; as well as can be, where the file system has no locks.
class FolderLock {
 public:
  explicit FolderLock(const fs::path& folder) : file_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
    while (file_ >= 0 && ::flock(file_, LOCK_EX) != 0 && errno == EINTR) {
    }
  }
  ~FolderLock() {
    if (file_ >= 0) ::close(file_);
  }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int file_;
};

fs::path name_path(const fs::path& folder, const std::string& source) {
  return folder / fmt::format("{:016x}.source", XXH3_64bits(source.data(), source.size()));
}

}  // namespace

Error SegmentCache::io_error(const char* what) const {
  return {ErrorKind::io, fmt::format("cache {}: cannot {}: {}", (path_.empty() ? folder_ : path_).string(), what,
                                     std::error_code(errno, std::generic_category()).message())};
}

Result<std::unique_ptr<SegmentCache>> SegmentCache::open(const fs::path& folder, std::uint64_t limit_bytes) {
  std::unique_ptr<SegmentCache> cache(new SegmentCache(folder, limit_bytes));
  std::error_code error;
  fs::create_directories(folder, error);
  if (!fs::is_directory(folder)) {
    return fail(ErrorKind::io, fmt::format("cache {}: cannot make the folder: {}", folder.string(),
                                           error ? error.message() : "something else has its name"));
  }
  if (::access(folder.c_str(), W_OK | X_OK) != 0) return tl::unexpected<Error>(cache->io_error("write to the folder"));
  return cache;
}

SegmentCache::~SegmentCache() { end(); }

void SegmentCache::end() {
  if (file_ < 0) return;
  (void)flush();
  ::close(file_);  // gives the lock back
  file_ = -1;
  end_ = 0;
  pending_.clear();
  head_.reset();
  index_.reset();
  cells_.clear();
  dropped_records_ = cut_bytes_ = 0;
  full_ = false;
}

std::optional<Digest> SegmentCache::recall(const std::string& source) const {
  const int file = ::open(name_path(folder_, source).c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return std::nullopt;
  std::vector<std::byte> bytes(16 + source.size() + 1);
  const ssize_t size = ::pread(file, bytes.data(), bytes.size(), 0);
  ::close(file);
  if (size != static_cast<ssize_t>(16 + source.size())) return std::nullopt;
  if (std::memcmp(bytes.data() + 16, source.data(), source.size()) != 0) return std::nullopt;
  Digest digest{};
  std::memcpy(digest.data(), bytes.data(), digest.size());
  return digest;
}

Result<void> SegmentCache::remember(const std::string& source, const Digest& digest) {
  if (recall(source) == digest) return {};
  std::vector<std::byte> bytes(16 + source.size());
  std::memcpy(bytes.data(), digest.data(), digest.size());
  std::memcpy(bytes.data() + 16, source.data(), source.size());
  return write_file_atomically(name_path(folder_, source), std::span<const std::byte>(bytes));
}

Result<void> SegmentCache::begin(const Digest& digest) {
  end();
  path_ = folder_ / (hex_of(digest) + kExtension);
  Result<void> done = lock_file(path_);
  if (done) done = prepare_file(digest);
  if (done) done = scan();
  if (!done) {
    if (file_ >= 0) ::close(file_);
    file_ = -1;
    return done;
  }
  ::futimens(file_, nullptr);  // used now
  make_room_now(0);
  return {};
}

// Another process may remove the file between opening and locking it: then the name leads elsewhere.
Result<void> SegmentCache::lock_file(const fs::path& path) {
  for (int attempt = 0; attempt < 10; ++attempt) {
    file_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (file_ < 0) return tl::unexpected<Error>(io_error("open the file"));
    if (::flock(file_, LOCK_EX | LOCK_NB) != 0) {
      if (errno != EWOULDBLOCK) return tl::unexpected<Error>(io_error("lock the file"));
      return fail(ErrorKind::limit, fmt::format("cache {}: another process has this asset open", path.string()));
    }
    struct stat opened {
    }, named{};
    if (::fstat(file_, &opened) == 0 && ::stat(path.c_str(), &named) == 0 && opened.st_ino == named.st_ino &&
        opened.st_dev == named.st_dev) {
      return {};
    }
    ::close(file_);
    file_ = -1;
  }
  return fail(ErrorKind::io, fmt::format("cache {}: the file is removed again and again", path.string()));
}

// Anything that does not begin as a file of this asset begins anew.
Result<void> SegmentCache::prepare_file(const Digest& digest) {
  std::array<std::byte, kFileHeaderBytes> right{}, found{};
  std::memcpy(right.data(), kMagic.data(), kMagic.size());
  std::memcpy(right.data() + kMagic.size(), digest.data(), digest.size());
  if (read_exactly(file_, found, 0) && found == right) return {};
  struct stat status {};
  if (::fstat(file_, &status) != 0) return tl::unexpected<Error>(io_error("read the file"));
  cut_bytes_ = static_cast<std::uint64_t>(status.st_size);
  if (::ftruncate(file_, 0) != 0 || !write_exactly(file_, right, 0)) {
    return tl::unexpected<Error>(io_error("write the file"));
  }
  return {};
}

// Finds all records, and cuts off what is behind the last that is whole. Only headers are read.
Result<void> SegmentCache::scan() {
  struct stat status {};
  if (::fstat(file_, &status) != 0) return tl::unexpected<Error>(io_error("read the file"));
  const auto size = static_cast<std::uint64_t>(status.st_size);
  std::uint64_t at = kFileHeaderBytes;
  std::vector<std::byte> window;  // bytes of the file from window_at on
  std::uint64_t window_at = 0;
  while (at + kRecordHeaderBytes <= size) {
    if (at < window_at || at + kRecordHeaderBytes > window_at + window.size()) {
      window.resize(static_cast<std::size_t>(std::min<std::uint64_t>(256 * 1024, size - at)));
      window_at = at;
      if (!read_exactly(file_, window, at)) break;
    }
    const std::optional<RecordHeader> record = unpack(window.data() + (at - window_at));
    if (!record || record->size_bytes > size - at - kRecordHeaderBytes) break;
    note(static_cast<Kind>(record->kind), record->cell, {at, record->segment, record->size_bytes});
    at += kRecordHeaderBytes + record->size_bytes;
  }
  end_ = at;
  cut_bytes_ += size - at;
  if (at < size && ::ftruncate(file_, static_cast<off_t>(at)) != 0) {
    return tl::unexpected<Error>(io_error("cut the damaged end of the file"));
  }
  return {};
}

void SegmentCache::note(Kind kind, std::uint32_t cell, const Place& place) {
  if (kind == Kind::head) {
    head_ = place;
  } else if (kind == Kind::index) {
    index_ = place;
  } else {
    std::vector<Place>& places = cells_[cell];
    const auto at = std::lower_bound(places.begin(), places.end(), place.segment,
                                     [](const Place& a, std::uint32_t segment) { return a.segment < segment; });
    if (at != places.end() && at->segment == place.segment) {
      *at = place;
    } else {
      places.insert(at, place);
    }
  }
}

std::optional<SegmentCache::Place> SegmentCache::find(std::uint32_t cell, std::uint32_t segment) const {
  const auto found = cells_.find(cell);
  if (found == cells_.end()) return std::nullopt;
  const std::vector<Place>& places = found->second;
  const auto at = std::lower_bound(places.begin(), places.end(), segment,
                                   [](const Place& a, std::uint32_t number) { return a.segment < number; });
  return at != places.end() && at->segment == segment ? std::optional(*at) : std::nullopt;
}

bool SegmentCache::holds(std::uint32_t cell, std::uint32_t segment) const { return find(cell, segment).has_value(); }

// Into record_, header and content. False if it is not what was written.
bool SegmentCache::read_record(Kind kind, std::uint32_t cell, const Place& place) {
  record_.resize(kRecordHeaderBytes + place.size_bytes);
  if (place.offset >= end_) {
    const auto at = static_cast<std::size_t>(place.offset - end_);
    std::copy_n(pending_.begin() + static_cast<std::ptrdiff_t>(at), record_.size(), record_.begin());
  } else if (!read_exactly(file_, record_, place.offset)) {
    return false;
  }
  const std::optional<RecordHeader> record = unpack(record_.data());
  return record && record->kind == static_cast<std::uint8_t>(kind) && record->cell == cell &&
         record->segment == place.segment && record->size_bytes == place.size_bytes &&
         record->checksum == XXH3_64bits(record_.data() + kRecordHeaderBytes, place.size_bytes);
}

std::optional<std::vector<std::byte>> SegmentCache::section(Kind kind) {
  std::optional<Place>& place = kind == Kind::head ? head_ : index_;
  if (!place) return std::nullopt;
  if (!read_record(kind, 0, *place)) {
    place.reset();
    ++dropped_records_;
    return std::nullopt;
  }
  return std::vector<std::byte>(record_.begin() + kRecordHeaderBytes, record_.end());
}

std::optional<std::vector<std::byte>> SegmentCache::head() { return section(Kind::head); }
std::optional<std::vector<std::byte>> SegmentCache::index() { return section(Kind::index); }

std::optional<std::span<const std::byte>> SegmentCache::read(std::uint32_t cell, std::uint32_t segment) {
  const std::optional<Place> place = find(cell, segment);
  if (!place) return std::nullopt;
  if (!read_record(Kind::segment, cell, *place)) {
    std::erase_if(cells_[cell], [&](const Place& p) { return p.segment == segment; });
    ++dropped_records_;
    return std::nullopt;
  }
  return std::span<const std::byte>(record_).subspan(kRecordHeaderBytes);
}

Result<bool> SegmentCache::put_head(std::span<const std::byte> bytes) { return put(Kind::head, 0, 0, bytes); }
Result<bool> SegmentCache::put_index(std::span<const std::byte> bytes) { return put(Kind::index, 0, 0, bytes); }
Result<bool> SegmentCache::append(std::uint32_t cell, std::uint32_t segment, std::span<const std::byte> bytes) {
  return put(Kind::segment, cell, segment, bytes);
}

Result<bool> SegmentCache::put(Kind kind, std::uint32_t cell, std::uint32_t segment, std::span<const std::byte> bytes) {
  assert(begun());
  if (cell >= kMaxCells || segment >= kMaxSegmentsPerCell || bytes.size() > kMaxHeadBytes) return false;
  full_ = full_ || !make_room(kRecordHeaderBytes + bytes.size());
  if (full_) return false;
  const auto header = pack({static_cast<std::uint8_t>(kind), cell, segment, static_cast<std::uint32_t>(bytes.size()),
                            XXH3_64bits(bytes.data(), bytes.size())});
  const Place place{size_bytes(), segment, static_cast<std::uint32_t>(bytes.size())};
  pending_.insert(pending_.end(), header.begin(), header.end());
  pending_.insert(pending_.end(), bytes.begin(), bytes.end());
  note(kind, cell, place);
  if (pending_.size() >= kPendingBytes) {
    if (const Result<void> flushed = flush(); !flushed) return tl::unexpected<Error>(flushed.error());
  }
  return !full_;  // which a flush may find
}

// What could not be written is forgotten, and the file is as it was.
Result<void> SegmentCache::flush() {
  if (pending_.empty()) return {};
  const FolderLock lock(folder_);
  if (!make_room_now(0)) {  // others have written since it was said that there is room
    full_ = true;
    forget_pending();
    return {};
  }
  if (write_exactly(file_, pending_, end_)) {
    end_ += pending_.size();
    pending_.clear();
    return {};
  }
  Error error = io_error("write the file");
  if (::ftruncate(file_, static_cast<off_t>(end_)) != 0) error.message += "; its end will be cut when it is opened";
  forget_pending();
  return tl::unexpected<Error>(std::move(error));
}

void SegmentCache::forget_pending() {
  pending_.clear();
  const auto lost = [&](const Place& place) { return place.offset >= end_; };
  for (std::optional<Place>* section : {&head_, &index_}) {
    if (*section && lost(**section)) section->reset();
  }
  for (auto& [cell, places] : cells_) std::erase_if(places, lost);
}

// By what the others took when it was looked last.
bool SegmentCache::make_room(std::uint64_t bytes) {
  return size_bytes() + bytes + others_bytes_ <= limit_bytes_ || make_room_now(bytes);
}

bool SegmentCache::make_room_now(std::uint64_t bytes) {
  others_bytes_ = 0;
  const std::vector<OtherFile> others = other_files(folder_, path_);
  for (const OtherFile& other : others) others_bytes_ += other.size_bytes;
  for (const OtherFile& other : others) {
    if (size_bytes() + bytes + others_bytes_ <= limit_bytes_) break;
    if (remove_if_unused(other.path)) others_bytes_ -= other.size_bytes;
  }
  return size_bytes() + bytes + others_bytes_ <= limit_bytes_;
}

}  // namespace fanstream
