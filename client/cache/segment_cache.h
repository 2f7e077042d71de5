// What was received of assets, kept on disk from one session to the next: one file per asset, named by its digest, to
// which records are appended as they arrive. CACHE.md describes the bytes.
//
// A crash at any moment loses at most what was received last: a tail that is not whole is found and cut off when the
// file is opened. Every record is checked when it is read; a damaged one is dropped and can be fetched and appended
// again. Checksums find damage, not forgery: who can write to the folder can alter what is shown.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/asset/segment_source.h"
#include "common/support/result.h"

namespace fanstream {

// One asset at a time. Not thread safe; several processes may use one folder, but only one of them one asset.
// A process whose file sizes are limited (RLIMIT_FSIZE) has to ignore SIGXFSZ.
class SegmentCache {
 public:
  // Makes the folder if it is not there. limit_bytes: of all assets' files together, whichever processes write them;
  // those used longest ago are removed first. Errors (io) name the folder.
  static Result<std::unique_ptr<SegmentCache>> open(const std::filesystem::path& folder, std::uint64_t limit_bytes);
  ~SegmentCache();  // writes what is still to be written
  SegmentCache(const SegmentCache&) = delete;
  SegmentCache& operator=(const SegmentCache&) = delete;

  // The asset that a source had when it was last streamed, so that it can be asked for by its digest at once.
  std::optional<Digest> recall(const std::string& source) const;
  Result<void> remember(const std::string& source, const Digest& digest);

  // Opens the asset's file, or makes it. Errors: io; limit (another process has it open). After an error, and before
  // the first call, nothing is held and nothing can be appended.
  Result<void> begin(const Digest& digest);
  bool begun() const { return file_ >= 0; }

  // Preconditions of all below: begun().
  // Nothing: not held, or damaged and dropped.
  std::optional<std::vector<std::byte>> head();
  std::optional<std::vector<std::byte>> index();
  bool holds(std::uint32_t cell, std::uint32_t segment) const;
  // Valid until the next call. Nothing: as above.
  std::optional<std::span<const std::byte>> read(std::uint32_t cell, std::uint32_t segment);

  // False: not kept, because the limit is reached and no other asset is left to be removed. After an error (io: disk
  // full, for example) what was held before is still held.
  Result<bool> put_head(std::span<const std::byte> bytes);
  Result<bool> put_index(std::span<const std::byte> bytes);
  // What is held already is appended again and takes the place of the former.
  Result<bool> append(std::uint32_t cell, std::uint32_t segment, std::span<const std::byte> bytes);
  // To the file, not to the disk. What was kept since the last time is forgotten if other processes have taken its room
  // meanwhile, and by an error (io). Called by put and append from time to time.
  Result<void> flush();

  std::uint64_t size_bytes() const { return end_ + pending_.size(); }  // of the asset's file
  std::uint64_t dropped_records() const { return dropped_records_; }   // damaged, since begin()
  std::uint64_t cut_bytes() const { return cut_bytes_; }               // by begin()

 private:
  enum class Kind : std::uint8_t { head = 1, index = 2, segment = 3 };
  struct Place {
    std::uint64_t offset = 0;  // of the record
    std::uint32_t segment = 0;
    std::uint32_t size_bytes = 0;
  };
  SegmentCache(std::filesystem::path folder, std::uint64_t limit_bytes)
      : folder_(std::move(folder)), limit_bytes_(limit_bytes) {}
  void end();
  Result<void> lock_file(const std::filesystem::path& path);
  Result<void> prepare_file(const Digest& digest);
  Result<void> scan();
  void note(Kind kind, std::uint32_t cell, const Place& place);
  bool read_record(Kind kind, std::uint32_t cell, const Place& place);
  std::optional<std::vector<std::byte>> section(Kind kind);
  Result<bool> put(Kind kind, std::uint32_t cell, std::uint32_t segment, std::span<const std::byte> bytes);
  void forget_pending();
  bool make_room(std::uint64_t bytes);
  bool make_room_now(std::uint64_t bytes);
  std::optional<Place> find(std::uint32_t cell, std::uint32_t segment) const;
  Error io_error(const char* what) const;

  std::filesystem::path folder_, path_;
  std::uint64_t limit_bytes_;
  int file_ = -1;
  std::uint64_t end_ = 0;           // of what is in the file
  std::uint64_t others_bytes_ = 0;  // of the other assets' files
  std::vector<std::byte> pending_;  // appended and not yet written
  std::vector<std::byte> record_;   // the one read last
  std::optional<Place> head_, index_;
  std::unordered_map<std::uint32_t, std::vector<Place>> cells_;  // each by segment
  bool full_ = false;
  std::uint64_t dropped_records_ = 0, cut_bytes_ = 0;
};

}  // namespace fanstream
