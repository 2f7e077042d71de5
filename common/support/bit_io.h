// Single bits within bytes, the lowest first; a byte that is begun belongs to them.
#pragma once

#include "common/support/byte_io.h"

namespace fanstream {

class BitWriter {
 public:
  // Keeps a reference. finish() comes before anything else is written.
  explicit BitWriter(ByteWriter& out) : out_(out) {}
  void bit(bool value) {
    byte_ |= static_cast<std::uint32_t>(value) << count_;
    if (++count_ == 8) finish();
  }
  void bits(int count, std::uint32_t value) {
    for (int i = 0; i < count; ++i) bit((value >> static_cast<unsigned>(i) & 1U) != 0);
  }
  void finish() {
    if (count_ > 0) out_.u8(static_cast<std::uint8_t>(byte_));
    byte_ = count_ = 0;
  }

 private:
  ByteWriter& out_;
  std::uint32_t byte_ = 0;
  std::uint32_t count_ = 0;
};

class BitReader {
 public:
  // Keeps a reference, whose failed() counts.
  explicit BitReader(ByteReader& in) : in_(in) {}
  bool bit() {
    if (count_ == 0) byte_ = in_.u8();
    const bool value = (byte_ >> count_ & 1U) != 0;
    count_ = (count_ + 1) % 8;
    return value;
  }
  std::uint32_t bits(int count) {
    std::uint32_t value = 0;
    for (int i = 0; i < count; ++i) value |= static_cast<std::uint32_t>(bit()) << static_cast<unsigned>(i);
    return value;
  }
  const ByteReader& bytes() const { return in_; }

 private:
  ByteReader& in_;
  std::uint32_t byte_ = 0;
  std::uint32_t count_ = 0;
};

}  // namespace fanstream
