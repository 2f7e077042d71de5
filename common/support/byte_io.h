// Little-endian bytes in and out. The reader cannot read past its end: it fails once and for all, and says where.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "common/support/result.h"

namespace fanstream {

class ByteWriter {
 public:
  void u8(std::uint8_t v) { bytes_.push_back(static_cast<std::byte>(v)); }
  void u16(std::uint16_t v) { fixed(v, 2); }
  void u32(std::uint32_t v) { fixed(v, 4); }
  void u64(std::uint64_t v) { fixed(v, 8); }
  void f64(double v) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &v, sizeof bits);
    u64(bits);
  }
  void varint(std::uint64_t v) {  // LEB128: seven bits a byte, low first
    for (; v >= 0x80; v >>= 7U) u8(static_cast<std::uint8_t>(v | 0x80U));
    u8(static_cast<std::uint8_t>(v));
  }
  void bytes(std::span<const std::byte> data) { bytes_.insert(bytes_.end(), data.begin(), data.end()); }

  std::size_t size() const { return bytes_.size(); }
  std::vector<std::byte> take() { return std::move(bytes_); }
  const std::vector<std::byte>& view() const { return bytes_; }

 private:
  void fixed(std::uint64_t v, int count) {
    for (int i = 0; i < count; ++i) u8(static_cast<std::uint8_t>(v >> (8 * i)));
  }
  std::vector<std::byte> bytes_;
};

class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> data) : data_(data) {}

  std::uint8_t u8() { return static_cast<std::uint8_t>(fixed(1)); }
  std::uint16_t u16() { return static_cast<std::uint16_t>(fixed(2)); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(fixed(4)); }
  std::uint64_t u64() { return fixed(8); }
  double f64() {
    const std::uint64_t bits = u64();
    double v = 0.0;
    std::memcpy(&v, &bits, sizeof v);
    return v;
  }
  std::uint64_t varint() {
    std::uint64_t v = 0;
    for (int shift = 0; shift < 63; shift += 7) {
      const std::uint64_t byte = fixed(1);
      v |= (byte & 0x7FU) << shift;
      if ((byte & 0x80U) == 0) return v;
    }
    failed_ = true;
    return 0;
  }
  std::span<const std::byte> bytes(std::size_t count) {
    if (failed_ || count > remaining()) {
      failed_ = true;
      return {};
    }
    const std::span<const std::byte> view = data_.subspan(position_, count);
    position_ += count;
    return view;
  }

  bool failed() const { return failed_; }  // something was asked for that is not there
  std::size_t position() const { return position_; }
  std::size_t remaining() const { return data_.size() - position_; }
  // "<what>: <problem> at byte <position>"
  Error error(const std::string& what, const std::string& problem) const {
    return {ErrorKind::bad_input, what + ": " + problem + " at byte " + std::to_string(position_)};
  }

 private:
  std::uint64_t fixed(std::size_t count) {
    const std::span<const std::byte> view = bytes(count);
    std::uint64_t v = 0;
    for (std::size_t i = 0; i < view.size(); ++i) v |= std::to_integer<std::uint64_t>(view[i]) << (8 * i);
    return v;
  }
  std::span<const std::byte> data_;
  std::size_t position_ = 0;
  bool failed_ = false;
};

}  // namespace fanstream
