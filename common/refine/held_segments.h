// The segments that a client holds, still coded.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/asset/asset_layout.h"
#include "common/support/cache_lines.h"

namespace fanstream {

// A cell's segments lie in one piece, without room to spare. A segment of size 0 is held from the start. Not thread
// safe.
class HeldSegments {
 public:
  HeldSegments() = default;
  explicit HeldSegments(std::shared_ptr<const AssetIndex> index);

  // The index has come to know the cell: its empty segments are held.
  void learn(std::uint32_t cell);
  bool holds(std::uint32_t cell, std::uint32_t segment) const { return held_[number(cell, segment)]; }
  // How many segments of the cell are held without a gap, from the first on.
  std::uint32_t prefix(std::uint32_t cell) const;
  // Precondition: not held; `bytes` are as many as the index says.
  void add(std::uint32_t cell, std::uint32_t segment, std::span<const std::byte> bytes);
  // Forgets the segments from `keep` on, whatever their size is; the empty ones stay held. Returns the bytes freed.
  std::size_t release(std::uint32_t cell, std::uint32_t keep);
  // Empty if it is not held. Valid until segments of the cell are added or released.
  std::span<const std::byte> bytes(std::uint32_t cell, std::uint32_t segment) const;
  // Asks for the memory of a cell's bytes.
  void fetch(std::uint32_t cell) const { fetch_line(bytes_[cell].get()); }
  std::size_t memory_bytes() const;

 private:
  std::size_t number(std::uint32_t cell, std::uint32_t segment) const {
    return index_->cells[cell].first_segment + segment;
  }
  // Of the cell's held segments in [0, end).
  std::size_t size_of(std::uint32_t cell, std::uint32_t end) const;

  std::shared_ptr<const AssetIndex> index_;
  std::vector<bool> held_;                           // by segment, as the index numbers them
  std::vector<std::unique_ptr<std::byte[]>> bytes_;  // by cell
  std::size_t total_bytes_ = 0;
};

}  // namespace fanstream
