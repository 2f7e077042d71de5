// Frames: u8 type, u24 little-endian payload size, payload. Data frames begin with a checksum. See PROTOCOL.md,
// section 2.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "common/support/result.h"
#include "protocol/limits.h"
#include "protocol/wire.h"

namespace fanstream {

enum class FrameType : std::uint8_t {
  // client to server
  hello = 0x01,
  list = 0x02,
  open = 0x03,
  wants = 0x04,
  release = 0x05,
  credit = 0x06,
  // both ways
  ping = 0x10,
  pong = 0x11,
  // server to client
  welcome = 0x81,
  catalogue = 0x82,
  building = 0x83,
  opened = 0x84,
  wants_done = 0x85,
  degraded = 0x86,
  error = 0x87,
  head_data = 0x90,
  index_data = 0x91,
  segments = 0x92,
  segment_part = 0x93,
};

enum class Receiver { server, client };  // who reads the stream

// "hello", "segment part", ...; "frame type 0x7f" for one that does not exist.
std::string name(FrameType type);
bool is_data_frame(FrameType type);
// The largest payload that `receiver` takes in a frame of this type; nothing if the type is not for it.
std::optional<std::size_t> max_payload_bytes(FrameType type, Receiver receiver);

struct FrameView {
  FrameType type = FrameType::ping;
  Bytes payload;  // of data frames: what follows the checksum
};

// The low 32 bits of XXH3-64 over `fields` and then `blob`, plus the frame type times 0x9E3779B1 (mod 2^32).
std::uint32_t frame_checksum(FrameType type, Bytes fields, Bytes blob);

// Appends a frame without checksum. Precondition: payload below 2^24 bytes, not a data frame.
void write_frame(FrameType type, Bytes payload, std::vector<std::byte>& out);

// What precedes the blob of a data frame: frame header, checksum, fields. The blob itself is sent from where it lies.
class DataFrameHeader {
 public:
  // `fields` are written as varints. Preconditions: at most four fields, blob of at most kMaxChunkBytes.
  DataFrameHeader(FrameType type, std::span<const std::uint32_t> fields, Bytes blob);
  Bytes bytes() const { return Bytes(bytes_).first(size_); }

 private:
  std::array<std::byte, kFrameHeaderBytes + kMaxDataFieldsBytes> bytes_{};
  std::size_t size_ = 0;
};

// The same for a frame that lies whole in memory: `frame` begins with kDataContentAt bytes of any value, which become
// header and checksum. Precondition: what follows is at most kMaxChunkBytes + kMaxDataFieldsBytes - 4 bytes.
inline constexpr std::size_t kDataContentAt = kFrameHeaderBytes + 4;
void seal_data_frame(FrameType type, std::span<std::byte> frame);

// Cuts a byte stream, however it is chunked, into frames. Safe on hostile input: sizes are checked against the limit of
// the type as soon as the four header bytes are there, and memory grows only with bytes that really arrived.
// Not thread safe.
class FrameReader {
 public:
  explicit FrameReader(Receiver receiver) : receiver_(receiver) {}

  // Room for size_bytes more; commit() says how many were filled. Invalidates views given by next().
  std::span<std::byte> prepare(std::size_t size_bytes);
  void commit(std::size_t size_bytes);
  void push(Bytes bytes);

  // The next whole frame, nothing if more bytes are needed, or an error that names the stream's byte offset. After an
  // error the stream is lost: every further call gives the same error. The view is valid until the next non-const call.
  Result<std::optional<FrameView>> next();

  // A frame has begun to arrive and is not complete.
  bool mid_frame() const { return end_ > begin_; }
  // Received and not yet given out.
  std::size_t buffered_bytes() const { return end_ - begin_; }
  // Until lifted with nothing, only this type (and error) is taken: the handshake's frame, so that a stranger cannot
  // make us buffer.
  void restrict_to(std::optional<FrameType> type) { only_ = type; }
  // Stream offset of the next frame's first byte.
  std::uint64_t offset_bytes() const { return offset_bytes_; }
  std::size_t memory_bytes() const { return buffer_.capacity(); }
  // Gives memory back when nothing is buffered; for the many idle sessions of a server.
  void shrink();

 private:
  Error fault(std::string_view what, std::optional<FrameType> type);

  Receiver receiver_;
  std::optional<FrameType> only_;
  std::vector<std::byte> buffer_;
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  std::uint64_t offset_bytes_ = 0;
  std::optional<Error> failed_;
};

}  // namespace fanstream
