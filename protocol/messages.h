// The messages that frames carry, as structs. encode() appends a whole frame; decode_...() reads a payload strictly:
// anything missing, malformed, beyond a limit or left over is an error that names the message and the payload's byte.
// Byte layouts: PROTOCOL.md, section 3.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/asset/segment_source.h"
#include "common/support/result.h"
#include "protocol/frame.h"
#include "protocol/runs.h"

namespace fanstream {

// Bits of Hello::features and Welcome::features. Version 2 defines none; both ends ignore bits they do not know.
struct Hello {
  std::uint16_t version_min = kProtocolVersionMin;
  std::uint16_t version_max = kProtocolVersionMax;
  std::uint32_t features = 0;
};

struct Welcome {
  std::uint16_t version = kProtocolVersionMax;
  std::uint32_t features = 0;         // those both ends know
  std::uint32_t idle_timeout_ms = 0;  // the server gives up on a client that it has not heard for so long
};

// What a client already holds of a model. If the server still has this digest, it never sends those parts again.
struct Have {
  Digest digest{};
  bool head = false;
  bool index = false;
  std::vector<CellRun> cells;
};

struct Open {
  std::string model;  // 1 to kMaxNameBytes bytes
  std::optional<Have> have;
};

struct Wants {
  std::uint32_t epoch = 0;  // larger than every earlier one of the session
  std::vector<CellRun> runs;
};

// From now on the client holds only these prefixes of these cells; it may want the rest again.
struct Release {
  std::vector<CellRun> runs;
};

struct Credit {
  std::uint64_t bytes = 0;  // added to what the server may still send
};

struct Ping {
  std::uint64_t token = 0;
};

enum class ModelState : std::uint8_t { ready = 0, building = 1, failed = 2 };

struct CatalogueEntry {
  std::string name;
  ModelState state = ModelState::ready;
  std::uint16_t permille = 0;  // building: 0 to 1000
  std::string reason;          // failed
  Digest digest{};             // ready, as the counts below
  std::uint64_t size_bytes = 0;
  std::uint64_t vertex_count = 0;
  std::uint64_t triangle_count = 0;
  friend bool operator==(const CatalogueEntry&, const CatalogueEntry&) = default;
};

// One frame of an answer to list; a long catalogue takes several.
struct CataloguePart {
  bool last = true;
  std::vector<CatalogueEntry> entries;
};

struct Building {
  std::uint16_t permille = 0;
};

struct Opened {
  bool resumed = false;  // the statement of open's `have` was accepted
  Digest digest{};
  std::uint32_t cell_count = 0;
  std::uint64_t segment_total = 0;  // over all cells
  std::uint64_t head_size_bytes = 0;
  std::uint64_t index_size_bytes = 0;
  std::uint64_t size_bytes = 0;
  std::uint64_t vertex_count = 0;
  std::uint64_t triangle_count = 0;
};

struct WantsDone {
  std::uint32_t epoch = 0;
  std::uint32_t release_count = 0;  // as in SegmentBatch
};

enum class DegradedReason : std::uint8_t {
  none = 0,       // back to normal
  no_credit = 1,  // wanted segments wait because the client grants no bytes
};

struct Degraded {
  DegradedReason reason = DegradedReason::none;
  std::string text;
};

enum class ErrorCode : std::uint16_t {
  version_mismatch = 1,  // detail: the server's min version, and its max << 16
  bad_frame = 2,
  bad_message = 3,
  unexpected_message = 4,
  limit = 5,
  unknown_model = 6,
  model_failed = 7,
  want_out_of_range = 8,  // detail: the epoch
  handshake_timeout = 9,
  idle_timeout = 10,
  stalled = 11,
  server_full = 12,
  shutting_down = 13,
  internal = 14,
};

struct ErrorMessage {
  ErrorCode code = ErrorCode::internal;
  bool fatal = true;  // the sender closes the connection after it
  std::uint32_t detail = 0;
  std::string text;
};

std::string name(ErrorCode code);
ErrorKind error_kind(ErrorCode code);

void encode(const Hello& message, std::vector<std::byte>& out);
void encode(const Welcome& message, std::vector<std::byte>& out);
void encode(const Open& message, std::vector<std::byte>& out);
void encode(const Wants& message, std::vector<std::byte>& out);
void encode(const Release& message, std::vector<std::byte>& out);
void encode(const Credit& message, std::vector<std::byte>& out);
void encode(FrameType ping_or_pong, const Ping& message, std::vector<std::byte>& out);
void encode(const Building& message, std::vector<std::byte>& out);
void encode(const Opened& message, std::vector<std::byte>& out);
void encode(const WantsDone& message, std::vector<std::byte>& out);
void encode(const Degraded& message, std::vector<std::byte>& out);
void encode(const ErrorMessage& message, std::vector<std::byte>& out);
// As many frames as it takes.
void encode_catalogue(const std::vector<CatalogueEntry>& entries, std::vector<std::byte>& out);

Result<Hello> decode_hello(Bytes payload);
Result<Welcome> decode_welcome(Bytes payload);
Result<Open> decode_open(Bytes payload);
Result<Wants> decode_wants(Bytes payload);
Result<Release> decode_release(Bytes payload);
Result<Credit> decode_credit(Bytes payload);
Result<Ping> decode_ping(Bytes payload);
Result<CataloguePart> decode_catalogue(Bytes payload);
Result<Building> decode_building(Bytes payload);
Result<Opened> decode_opened(Bytes payload);
Result<WantsDone> decode_wants_done(Bytes payload);
Result<Degraded> decode_degraded(Bytes payload);
Result<ErrorMessage> decode_error(Bytes payload);

// Payloads of data frames, without the checksum. `bytes` points into the payload.
struct BlobPart {  // head data, index data
  std::uint32_t offset_bytes = 0;
  Bytes bytes;
};
// Whole segments. Each is the next of its cell in the order of sending: which one that is, and how large, follows from
// the segment table and from what was sent before (segment_table.h, PROTOCOL.md, section 3).
struct BatchRun {  // `segment_count` segments of each of these cells, cell by cell
  std::uint32_t first_cell = 0;
  std::uint32_t cell_count = 1;
  std::uint32_t segment_count = 1;
  friend bool operator==(const BatchRun&, const BatchRun&) = default;
};
struct SegmentBatch {
  std::uint32_t release_count = 0;  // releases of this session that the server had read when it chose the segments
  std::vector<BatchRun> runs;
  Bytes bytes;  // one segment behind another
};
// A part of a segment that is larger than kMaxChunkBytes: the next of its cell, as above.
struct SegmentPart {
  std::uint32_t release_count = 0;
  std::uint32_t cell = 0;
  std::uint32_t offset_bytes = 0;
  Bytes bytes;
};
Result<BlobPart> decode_blob_part(FrameType type, Bytes payload);
// No more segments than bytes: an empty segment is never sent.
Result<SegmentBatch> decode_segments(Bytes payload);
Result<SegmentPart> decode_segment_part(Bytes payload);

// What precedes the bytes of a batch. Precondition: every run names at least one cell and one segment.
void write_batch_fields(std::uint32_t release_count, std::span<const BatchRun> runs, WireWriter& out);
// Adds the next `segment_count` segments of a cell to a batch.
void add_to_batch(std::uint32_t cell, std::uint32_t segment_count, std::vector<BatchRun>& runs);

}  // namespace fanstream
