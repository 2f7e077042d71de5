// What the network side needs to know of an asset: opaque, checksummed blobs by name. The file format behind it is
// ASSET.md.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace fanstream {

using Digest = std::array<std::uint8_t, 16>;  // XXH3-128 of the asset's content, big-endian

// An immutable asset. Thread safety: all members may be called from any number of threads at once.
class SegmentSource {
 public:
  virtual ~SegmentSource() = default;
  virtual Digest digest() const = 0;
  // Header, coding tables and FM0: enough for a first picture. Sent first.
  virtual std::span<const std::byte> head() const = 0;
  // The cell table: what there is to want. Sent second. It may leave out cells of which a segment of another tells.
  virtual std::span<const std::byte> index() const = 0;
  virtual std::uint32_t cell_count() const = 0;
  // Segments of a cell, coarse to fine; a want for prefix p means segments 0..p-1.
  virtual std::uint32_t segment_count(std::uint32_t cell) const = 0;
  // Valid as long as the source lives. Precondition: cell < cell_count(), segment < segment_count(cell).
  virtual std::span<const std::byte> segment(std::uint32_t cell, std::uint32_t segment) const = 0;
  virtual std::uint64_t vertex_count() const = 0;
  virtual std::uint64_t triangle_count() const = 0;
  virtual std::uint64_t size_bytes() const = 0;  // of the whole asset
};

}  // namespace fanstream
