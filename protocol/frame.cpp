#include "protocol/frame.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <string>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace fanstream {

std::string name(FrameType type) {
  switch (type) {
    case FrameType::hello: return "hello";
    case FrameType::list: return "list";
    case FrameType::open: return "open";
    case FrameType::wants: return "wants";
    case FrameType::release: return "release";
    case FrameType::credit: return "credit";
    case FrameType::ping: return "ping";
    case FrameType::pong: return "pong";
    case FrameType::welcome: return "welcome";
    case FrameType::catalogue: return "catalogue";
    case FrameType::building: return "building";
    case FrameType::opened: return "opened";
    case FrameType::wants_done: return "wants done";
    case FrameType::degraded: return "degraded";
    case FrameType::error: return "error";
    case FrameType::head_data: return "head data";
    case FrameType::index_data: return "index data";
    case FrameType::segments: return "segments";
    case FrameType::segment_part: return "segment part";
  }
  constexpr char kHex[] = "0123456789abcdef";
  const auto value = static_cast<unsigned>(type);
  return std::string("frame type 0x") + kHex[value >> 4] + kHex[value & 15U];
}

bool is_data_frame(FrameType type) {
  return type == FrameType::head_data || type == FrameType::index_data || type == FrameType::segments ||
         type == FrameType::segment_part;
}

std::optional<std::size_t> max_payload_bytes(FrameType type, Receiver receiver) {
  const bool server = receiver == Receiver::server;
  const auto only_if = [](bool allowed, std::size_t limit) {
    return allowed ? std::optional<std::size_t>(limit) : std::nullopt;
  };
  switch (type) {
    case FrameType::hello: return only_if(server, kMaxHelloBytes);
    case FrameType::list: return only_if(server, 0);
    case FrameType::open:
    case FrameType::wants:
    case FrameType::release: return only_if(server, kMaxRunsBytes);
    case FrameType::credit: return only_if(server, 10);
    case FrameType::ping:
    case FrameType::pong: return 8;
    case FrameType::welcome: return only_if(!server, kMaxHelloBytes);
    case FrameType::catalogue: return only_if(!server, kMaxCatalogueFrameBytes);
    case FrameType::building: return only_if(!server, 2);
    case FrameType::opened: return only_if(!server, 128);
    case FrameType::wants_done: return only_if(!server, 10);
    case FrameType::degraded:
    case FrameType::error: return only_if(!server, kMaxTextBytes + 16);
    case FrameType::head_data:
    case FrameType::index_data:
    case FrameType::segments:
    case FrameType::segment_part: return only_if(!server, kMaxChunkBytes + kMaxDataFieldsBytes);
  }
  return std::nullopt;
}

namespace {

// The type lies outside the hashed bytes, so it is added. Seeding with it would cost a new secret per frame.
std::uint32_t finish_checksum(FrameType type, XXH64_hash_t hash) {
  return static_cast<std::uint32_t>(hash) + static_cast<std::uint32_t>(type) * 0x9E3779B1U;
}

std::uint32_t whole_checksum(FrameType type, Bytes content) {
  return finish_checksum(type, XXH3_64bits(content.data(), content.size()));
}

}  // namespace

std::uint32_t frame_checksum(FrameType type, Bytes fields, Bytes blob) {
  std::array<std::byte, 256> joined;
  if (fields.size() + blob.size() <= joined.size()) {
    std::copy(fields.begin(), fields.end(), joined.begin());
    std::copy(blob.begin(), blob.end(), joined.begin() + static_cast<std::ptrdiff_t>(fields.size()));
    return whole_checksum(type, Bytes(joined).first(fields.size() + blob.size()));
  }
  XXH3_state_t state;
  XXH3_INITSTATE(&state);
  XXH3_64bits_reset(&state);
  XXH3_64bits_update(&state, fields.data(), fields.size());
  XXH3_64bits_update(&state, blob.data(), blob.size());
  return finish_checksum(type, XXH3_64bits_digest(&state));
}

namespace {

void put_little_endian(std::byte* to, std::uint32_t value, int count) {
  for (int i = 0; i < count; ++i) to[i] = static_cast<std::byte>(value >> (8 * i));
}

std::uint32_t get_little_endian(const std::byte* from, int count) {
  std::uint32_t value = 0;
  for (int i = 0; i < count; ++i) value |= std::to_integer<std::uint32_t>(from[i]) << (8 * i);
  return value;
}

void put_frame_header(std::byte* to, FrameType type, std::size_t payload_size) {
  to[0] = static_cast<std::byte>(type);
  put_little_endian(to + 1, static_cast<std::uint32_t>(payload_size), 3);
}

}  // namespace

void write_frame(FrameType type, Bytes payload, std::vector<std::byte>& out) {
  assert(payload.size() < (1U << 24) && !is_data_frame(type));
  std::array<std::byte, kFrameHeaderBytes> header{};
  put_frame_header(header.data(), type, payload.size());
  out.insert(out.end(), header.begin(), header.end());
  out.insert(out.end(), payload.begin(), payload.end());
}

DataFrameHeader::DataFrameHeader(FrameType type, std::span<const std::uint32_t> fields, Bytes blob) {
  assert(is_data_frame(type) && fields.size() <= 4 && blob.size() <= kMaxChunkBytes);
  size_ = kDataContentAt;
  for (std::uint32_t value : fields) {
    for (; value >= 0x80; value >>= 7) bytes_[size_++] = static_cast<std::byte>(value | 0x80U);
    bytes_[size_++] = static_cast<std::byte>(value);
  }
  put_frame_header(bytes_.data(), type, size_ - kFrameHeaderBytes + blob.size());
  const Bytes written_fields = bytes().subspan(kDataContentAt);
  put_little_endian(bytes_.data() + kFrameHeaderBytes, frame_checksum(type, written_fields, blob), 4);
}

void seal_data_frame(FrameType type, std::span<std::byte> frame) {
  assert(is_data_frame(type) && frame.size() >= kDataContentAt);
  assert(frame.size() - kFrameHeaderBytes <= kMaxChunkBytes + kMaxDataFieldsBytes);
  put_frame_header(frame.data(), type, frame.size() - kFrameHeaderBytes);
  put_little_endian(frame.data() + kFrameHeaderBytes, whole_checksum(type, frame.subspan(kDataContentAt)), 4);
}

std::span<std::byte> FrameReader::prepare(std::size_t size_bytes) {
  if (buffer_.size() - end_ < size_bytes && begin_ > 0) {
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
  }
  if (buffer_.size() - end_ < size_bytes) buffer_.resize(std::max(end_ + size_bytes, buffer_.size() * 2));
  return std::span(buffer_).subspan(end_, size_bytes);
}

void FrameReader::commit(std::size_t size_bytes) {
  assert(size_bytes <= buffer_.size() - end_);
  end_ += size_bytes;
}

void FrameReader::push(Bytes bytes) {
  if (bytes.empty()) return;
  const std::span<std::byte> room = prepare(bytes.size());
  std::memcpy(room.data(), bytes.data(), bytes.size());
  commit(bytes.size());
}

void FrameReader::shrink() {
  if (mid_frame()) return;
  buffer_ = {};
  begin_ = end_ = 0;
}

Error FrameReader::fault(std::string_view what, std::optional<FrameType> type) {
  std::string message = "stream byte " + std::to_string(offset_bytes_) + ": ";
  if (type) message += name(*type) + ": ";
  failed_ = Error{ErrorKind::bad_input, message + std::string(what)};
  return *failed_;
}

Result<std::optional<FrameView>> FrameReader::next() {
  if (failed_) return tl::unexpected<Error>(*failed_);
  const std::size_t available = end_ - begin_;
  if (available == 0) return std::optional<FrameView>();
  const std::byte* const start = buffer_.data() + begin_;
  const auto type = static_cast<FrameType>(start[0]);
  if (only_ && type != *only_ && type != FrameType::error) {
    return tl::unexpected<Error>(fault("a Fanstream peer begins with " + name(*only_), type));
  }
  const std::optional<std::size_t> limit = max_payload_bytes(type, receiver_);
  if (!limit) return tl::unexpected<Error>(fault("not a frame that may be sent in this direction", type));
  if (available < kFrameHeaderBytes) return std::optional<FrameView>();
  const std::size_t payload_size = get_little_endian(start + 1, 3);
  if (payload_size > *limit) {
    return tl::unexpected<Error>(
        fault("claims " + std::to_string(payload_size) + " bytes, the limit is " + std::to_string(*limit), type));
  }
  if (is_data_frame(type) && payload_size < 4) {
    return tl::unexpected<Error>(fault("too short to hold its checksum", type));
  }
  if (available - kFrameHeaderBytes < payload_size) return std::optional<FrameView>();

  Bytes payload(start + kFrameHeaderBytes, payload_size);
  if (is_data_frame(type)) {
    const std::uint32_t stated = get_little_endian(payload.data(), 4);
    payload = payload.subspan(4);
    if (whole_checksum(type, payload) != stated) {
      return tl::unexpected<Error>(fault("checksum mismatch, the bytes were damaged on their way", type));
    }
  }
  begin_ += kFrameHeaderBytes + payload_size;
  offset_bytes_ += kFrameHeaderBytes + payload_size;
  return std::optional<FrameView>(FrameView{type, payload});
}

}  // namespace fanstream
