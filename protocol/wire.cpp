#include "protocol/wire.h"

namespace fanstream {
namespace {

// The size of the well-formed, printable character at `position`, or 0.
std::size_t printable_character_size(std::string_view text, std::size_t position) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[position + i]); };
  const unsigned lead = byte(0);
  if (lead < 0x80) return lead >= 0x20 && lead != 0x7F ? 1 : 0;
  const std::size_t size = lead >= 0xC2 && lead <= 0xDF   ? 2
                           : lead >= 0xE0 && lead <= 0xEF ? 3
                           : lead >= 0xF0 && lead <= 0xF4 ? 4
                                                          : 0;
  if (size == 0 || position + size > text.size()) return 0;
  for (std::size_t i = 1; i < size; ++i) {
    if ((byte(i) & 0xC0U) != 0x80U) return 0;
  }
  const unsigned second = byte(1);
  if (lead == 0xC2 && second < 0xA0) return 0;                                       // C1 control characters
  if (lead == 0xE0 && second < 0xA0) return 0;                                       // overlong
  if (lead == 0xED && second > 0x9F) return 0;                                       // surrogates
  if ((lead == 0xF0 && second < 0x90) || (lead == 0xF4 && second > 0x8F)) return 0;  // overlong, above U+10FFFF
  return size;
}

}  // namespace

void WireWriter::fixed(std::uint64_t value, int count) {
  for (int i = 0; i < count; ++i) u8(static_cast<std::uint8_t>(value >> (8 * i)));
}

void WireWriter::varint(std::uint64_t value) {
  while (value >= 0x80) {
    u8(static_cast<std::uint8_t>(value | 0x80U));
    value >>= 7;
  }
  u8(static_cast<std::uint8_t>(value));
}

void WireWriter::text(std::string_view value, std::size_t max_bytes) {
  std::string clean;
  for (std::size_t i = 0; i < value.size();) {
    const std::size_t size = printable_character_size(value, i);
    if (clean.size() + (size == 0 ? 1 : size) > max_bytes) break;
    if (size == 0) {
      clean += '?';
    } else {
      clean += value.substr(i, size);
    }
    i += size == 0 ? 1 : size;
  }
  varint(clean.size());
  bytes(as_bytes(clean));
}

std::uint64_t WireReader::fixed(int count) {
  const Bytes field = bytes(static_cast<std::size_t>(count));
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < field.size(); ++i) value |= std::to_integer<std::uint64_t>(field[i]) << (8 * i);
  return value;
}

std::uint64_t WireReader::varint(std::uint64_t max) {
  std::uint64_t value = 0;
  for (int shift = 0; shift < 64; shift += 7) {
    const Bytes next = bytes(1);
    if (next.empty()) return 0;
    const auto byte = std::to_integer<std::uint64_t>(next[0]);
    if (shift == 63 && byte > 1) break;
    value |= (byte & 0x7FU) << shift;
    if (byte < 0x80) {
      if ((byte == 0 && shift > 0) || value > max) break;
      return value;
    }
  }
  ok_ = false;
  return 0;
}

Bytes WireReader::bytes(std::size_t count) {
  if (!ok_ || count > remaining()) {
    ok_ = false;
    return {};
  }
  const Bytes view = bytes_.subspan(offset_, count);
  offset_ += count;
  return view;
}

std::string WireReader::text(std::size_t max_bytes) {
  const auto size = static_cast<std::size_t>(varint(max_bytes));
  const Bytes view = bytes(size);
  std::string value(reinterpret_cast<const char*>(view.data()), view.size());
  if (!is_printable_utf8(value)) {
    ok_ = false;
    return {};
  }
  return value;
}

bool is_printable_utf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t size = printable_character_size(text, i);
    if (size == 0) return false;
    i += size;
  }
  return true;
}

}  // namespace fanstream
