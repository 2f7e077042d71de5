// An asset as a file on disk, checked as a whole and mapped into memory; or the same from bytes in memory.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/asset/asset_layout.h"

namespace fanstream {

// Immutable once opened, with every byte of it checked against the content digest. Thread safety: as SegmentSource.
//
// The file is mapped read-only and private, so a file that is renamed over or deleted stays readable here as it was.
// Only one that is cut short or overwritten in place while it is open is dangerous: reading a page that is gone
// kills the process (SIGBUS), which nothing but a copy can prevent. Hence the server maps only files of its own store,
// which are only ever replaced by renaming; programs that show a file for a moment may map it where it lies.
class AssetFile final : public SegmentSource {
 public:
  // Errors name the file, the bytes and what to do: not_found, io, bad_input (empty, cut short,
  // not an asset, one flipped byte), unsupported (another version), limit.
  static Result<std::shared_ptr<const AssetFile>> open(const std::filesystem::path& path);
  // `name` takes the path's place in errors.
  static Result<std::shared_ptr<const AssetFile>> from_memory(std::vector<std::byte> bytes, std::string name);
  ~AssetFile() override;
  AssetFile(const AssetFile&) = delete;
  AssetFile& operator=(const AssetFile&) = delete;

  // The whole file: head, index and segments lie in it one after another, without gaps; then the blocks' checksums.
  std::span<const std::byte> bytes() const { return bytes_; }
  const AssetPreamble& preamble() const { return preamble_; }
  const std::shared_ptr<const AssetHead>& asset_head() const { return head_; }
  // With all pages.
  const std::shared_ptr<const AssetIndex>& asset_index() const { return index_; }
  const std::string& name() const { return name_; }

  Digest digest() const override { return preamble_.digest; }
  std::span<const std::byte> head() const override { return bytes_.first(preamble_.head_bytes); }
  std::span<const std::byte> index() const override {
    return bytes_.subspan(preamble_.head_bytes, preamble_.index_bytes);
  }
  // With one more cell, of one segment, where there are polygons (AssetIndex::polygons).
  std::uint32_t cell_count() const override {
    return static_cast<std::uint32_t>(index_->cells.size() + (index_->polygons.size_bytes != 0 ? 1 : 0));
  }
  std::uint32_t segment_count(std::uint32_t cell) const override { return index_->piece_count(cell); }
  std::span<const std::byte> segment(std::uint32_t cell, std::uint32_t segment) const override;
  std::uint64_t vertex_count() const override { return head_->vertex_count; }
  std::uint64_t triangle_count() const override { return head_->triangle_count; }
  std::uint64_t size_bytes() const override { return bytes_.size(); }

 private:
  AssetFile() = default;
  Result<void> read();
  Result<void> check_start() const;
  std::span<const std::byte> content() const;
  std::optional<std::uint64_t> first_damaged_block() const;
  Error damage(std::optional<std::uint64_t> block) const;

  std::string name_;
  std::vector<std::byte> owned_;  // or
  void* mapping_ = nullptr;       // of bytes_.size() bytes
  std::span<const std::byte> bytes_;
  AssetPreamble preamble_;
  std::shared_ptr<const AssetHead> head_;
  std::shared_ptr<const AssetIndex> index_;
};

// "9f86d081..." as programs print it: 32 hexadecimal digits.
std::string text_of(const Digest& digest);

}  // namespace fanstream
