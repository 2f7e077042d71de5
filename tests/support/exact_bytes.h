// Bytes in an allocation of exactly their size, so that a sanitizer sees any read beyond them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <span>

namespace fanstream::testing {

class ExactBytes {
 public:
  explicit ExactBytes(std::span<const std::byte> bytes) : bytes_(new std::byte[bytes.size()]), size_(bytes.size()) {
    std::copy(bytes.begin(), bytes.end(), bytes_.get());
  }
  std::span<std::byte> view() { return {bytes_.get(), size_}; }
  std::span<const std::byte> view() const { return {bytes_.get(), size_}; }
  void flip(std::size_t bit) { bytes_[bit / 8] ^= static_cast<std::byte>(1U << (bit % 8)); }

 private:
  std::unique_ptr<std::byte[]> bytes_;
  std::size_t size_;
};

}  // namespace fanstream::testing
