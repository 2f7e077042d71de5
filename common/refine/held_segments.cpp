#include "common/refine/held_segments.h"

#include <algorithm>

namespace fanstream {

HeldSegments::HeldSegments(std::shared_ptr<const AssetIndex> index)
    : index_(std::move(index)), held_(index_->segments.size()), bytes_(index_->cells.size()) {
  for (std::size_t s = 0; s < held_.size(); ++s) held_[s] = index_->segments[s].size_bytes == 0;
}

void HeldSegments::learn(std::uint32_t cell) {
  for (std::uint32_t s = 0; s < index_->cells[cell].segment_count; ++s) {
    if (index_->segments[number(cell, s)].size_bytes == 0) held_[number(cell, s)] = true;
  }
}

std::uint32_t HeldSegments::prefix(std::uint32_t cell) const {
  std::uint32_t count = 0;
  while (count < index_->cells[cell].segment_count && holds(cell, count)) ++count;
  return count;
}

std::size_t HeldSegments::size_of(std::uint32_t cell, std::uint32_t end) const {
  std::size_t size = 0;
  for (std::uint32_t s = 0; s < end; ++s) {
    if (holds(cell, s)) size += index_->segments[number(cell, s)].size_bytes;
  }
  return size;
}

void HeldSegments::add(std::uint32_t cell, std::uint32_t segment, std::span<const std::byte> bytes) {
  const std::size_t before = size_of(cell, segment);
  const std::size_t old_size = size_of(cell, index_->cells[cell].segment_count);
  std::unique_ptr<std::byte[]> joined(new std::byte[old_size + bytes.size()]);
  const std::byte* const old = bytes_[cell].get();
  std::copy(old, old + before, joined.get());
  std::copy(bytes.begin(), bytes.end(), joined.get() + before);
  std::copy(old + before, old + old_size, joined.get() + before + bytes.size());
  bytes_[cell] = std::move(joined);
  held_[number(cell, segment)] = true;
  total_bytes_ += bytes.size();
}

std::size_t HeldSegments::release(std::uint32_t cell, std::uint32_t keep) {
  const std::uint32_t count = index_->cells[cell].segment_count;
  if (keep >= count) return 0;
  const std::size_t kept = size_of(cell, keep);
  const std::size_t freed = size_of(cell, count) - kept;
  for (std::uint32_t s = keep; s < count; ++s) {
    const std::size_t n = number(cell, s);
    if (index_->segments[n].size_bytes != 0) held_[n] = false;
  }
  if (freed == 0) return 0;
  std::unique_ptr<std::byte[]> rest;
  if (kept != 0) {
    rest.reset(new std::byte[kept]);
    std::copy(bytes_[cell].get(), bytes_[cell].get() + kept, rest.get());
  }
  bytes_[cell] = std::move(rest);
  total_bytes_ -= freed;
  return freed;
}

std::span<const std::byte> HeldSegments::bytes(std::uint32_t cell, std::uint32_t segment) const {
  if (!holds(cell, segment)) return {};
  return {bytes_[cell].get() + size_of(cell, segment), index_->segments[number(cell, segment)].size_bytes};
}

std::size_t HeldSegments::memory_bytes() const {
  return total_bytes_ + held_.capacity() / 8 + bytes_.capacity() * sizeof(bytes_[0]);
}

}  // namespace fanstream
