// How many segments each cell has and how large they are: known to the server with the asset, to the client with the
// index, or of some cells later, with a segment of another cell that tells of them. Both ends derive from it which
// segment of a cell comes next, so that frames need not say it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace fanstream {

class SegmentTable {
 public:
  void reserve(std::size_t cells, std::size_t segments) { ends_.reserve(cells), sizes_bytes_.reserve(segments); }
  // Segments of the next cell, coarse to fine.
  void add_cell(std::span<const std::uint32_t> sizes_bytes) {
    sizes_bytes_.insert(sizes_bytes_.end(), sizes_bytes.begin(), sizes_bytes.end());
    ends_.push_back(sizes_bytes_.size());
    for (const std::uint32_t size : sizes_bytes) nonempty_total_ += size > 0 ? 1 : 0;
  }

  // Of whose segments only the count is known.
  void add_unknown_cell(std::uint32_t segment_count) {
    sizes_bytes_.insert(sizes_bytes_.end(), segment_count, kUnknown);
    ends_.push_back(sizes_bytes_.size());
    unknown_cells_ += segment_count > 0 ? 1 : 0;
  }
  // Precondition: as many sizes as the cell has segments.
  void learn_cell(std::uint32_t cell, std::span<const std::uint32_t> sizes_bytes) {
    if (is_known(cell)) return;
    std::copy(sizes_bytes.begin(), sizes_bytes.end(), sizes_bytes_.begin() + static_cast<std::ptrdiff_t>(begin(cell)));
    for (const std::uint32_t size : sizes_bytes) nonempty_total_ += size > 0 ? 1 : 0;
    --unknown_cells_;
  }

  std::size_t cell_count() const { return ends_.size(); }
  bool is_known(std::uint32_t cell) const {
    return ends_[cell] == begin(cell) || sizes_bytes_[begin(cell)] != kUnknown;
  }
  std::size_t unknown_cells() const { return unknown_cells_; }
  std::size_t segment_total() const { return sizes_bytes_.size(); }
  std::size_t nonempty_total() const { return nonempty_total_; }  // so many are sent, of the cells that are known
  // Preconditions: cell < cell_count(), segment < segment_count(cell).
  std::uint32_t segment_count(std::uint32_t cell) const {
    return static_cast<std::uint32_t>(ends_[cell] - begin(cell));
  }
  std::uint32_t size_bytes(std::uint32_t cell, std::uint32_t segment) const {
    return sizes_bytes_[begin(cell) + segment];
  }
  // The first segment at or after this one that has bytes, or segment_count(cell): empty ones are never sent and count
  // as held as soon as all before them are. Of cells that are not known, `segment`.
  std::uint32_t next_to_send(std::uint32_t cell, std::uint32_t segment) const {
    const std::uint32_t count = segment_count(cell);
    segment = std::min(segment, count);
    while (segment < count && size_bytes(cell, segment) == 0) ++segment;
    return segment;
  }

 private:
  static constexpr std::uint32_t kUnknown = 0xFFFFFFFFU;
  std::size_t begin(std::uint32_t cell) const { return cell == 0 ? 0 : ends_[cell - 1]; }
  std::vector<std::size_t> ends_;  // per cell, in sizes_bytes_
  std::vector<std::uint32_t> sizes_bytes_;
  std::size_t nonempty_total_ = 0;
  std::size_t unknown_cells_ = 0;
};

}  // namespace fanstream
