// Little-endian integers, varints and text in byte buffers. The reader cannot over-read and never allocates by a
// claimed size.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fanstream {

using Bytes = std::span<const std::byte>;

// Small numbers of either sign as small numbers without one: 0, -1, 1, -2, ... are 0, 1, 2, 3, ...
inline std::uint64_t zigzag(std::int64_t value) {
  return (static_cast<std::uint64_t>(value) << 1) ^ static_cast<std::uint64_t>(value >> 63);
}
inline std::int64_t unzigzag(std::uint64_t value) {
  return static_cast<std::int64_t>(value >> 1) ^ -static_cast<std::int64_t>(value & 1U);
}

// Appends to a buffer of the caller. Varints are LEB128: seven bits a byte, low bits first, the shortest form.
class WireWriter {
 public:
  explicit WireWriter(std::vector<std::byte>& out) : out_(out) {}
  void u8(std::uint8_t value) { out_.push_back(static_cast<std::byte>(value)); }
  void u16(std::uint16_t value) { fixed(value, 2); }
  void u32(std::uint32_t value) { fixed(value, 4); }
  void u64(std::uint64_t value) { fixed(value, 8); }
  void varint(std::uint64_t value);
  void bytes(Bytes value) { out_.insert(out_.end(), value.begin(), value.end()); }
  // A varint size and the bytes. Control characters and malformed UTF-8 become '?', longer text is cut at max_bytes.
  void text(std::string_view value, std::size_t max_bytes);

 private:
  void fixed(std::uint64_t value, int count);
  std::vector<std::byte>& out_;
};

// Reads from a view. After the first failure every read gives zero or nothing and ok() stays false, so a decoder checks
// once at its end (but before it allocates by a value that it read).
class WireReader {
 public:
  explicit WireReader(Bytes bytes) : bytes_(bytes) {}
  bool ok() const { return ok_; }
  std::size_t offset() const { return offset_; }
  std::size_t remaining() const { return bytes_.size() - offset_; }
  bool at_end() const { return ok_ && remaining() == 0; }

  std::uint8_t u8() { return static_cast<std::uint8_t>(fixed(1)); }
  std::uint16_t u16() { return static_cast<std::uint16_t>(fixed(2)); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(fixed(4)); }
  std::uint64_t u64() { return fixed(8); }
  // Fails on overlong forms and on values above `max`.
  std::uint64_t varint(std::uint64_t max = ~std::uint64_t{0});
  std::uint32_t varint32() { return static_cast<std::uint32_t>(varint(0xFFFFFFFFU)); }
  Bytes bytes(std::size_t count);
  Bytes rest() { return bytes(remaining()); }
  // Fails on more than max_bytes, malformed UTF-8 and control characters (text ends up on terminals).
  std::string text(std::size_t max_bytes);
  void reject() { ok_ = false; }

 private:
  std::uint64_t fixed(int count);
  Bytes bytes_;
  std::size_t offset_ = 0;
  bool ok_ = true;
};

// True for well-formed UTF-8 (RFC 3629) without C0, DEL and C1 control characters.
bool is_printable_utf8(std::string_view text);

inline Bytes as_bytes(std::string_view text) { return std::as_bytes(std::span(text.data(), text.size())); }

}  // namespace fanstream
