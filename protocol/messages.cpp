#include "protocol/messages.h"

#include <algorithm>

namespace fanstream {
namespace {

tl::unexpected<Error> malformed(FrameType type, const WireReader& in) {
  return fail(ErrorKind::bad_input,
              name(type) + " message: malformed, cut short or too long at payload byte " + std::to_string(in.offset()));
}

template <class Message>
Result<Message> finish(FrameType type, const WireReader& in, Message message) {
  if (!in.at_end()) return malformed(type, in);
  return message;
}

// Writes one frame whose payload `fill` produces.
template <class Fill>
void frame(FrameType type, std::vector<std::byte>& out, Fill fill) {
  std::vector<std::byte> payload;
  WireWriter writer(payload);
  fill(writer);
  write_frame(type, payload, out);
}

void write_digest(const Digest& digest, WireWriter& out) { out.bytes(std::as_bytes(std::span(digest))); }

Digest read_digest(WireReader& in) {
  Digest digest{};
  const Bytes bytes = in.bytes(digest.size());
  for (std::size_t i = 0; i < bytes.size(); ++i) digest[i] = std::to_integer<std::uint8_t>(bytes[i]);
  return digest;
}

void write_entry(const CatalogueEntry& entry, WireWriter& out) {
  out.text(entry.name, kMaxNameBytes);
  out.u8(static_cast<std::uint8_t>(entry.state));
  switch (entry.state) {
    case ModelState::building: out.u16(entry.permille); break;
    case ModelState::failed: out.text(entry.reason, kMaxTextBytes); break;
    case ModelState::ready:
      write_digest(entry.digest, out);
      out.varint(entry.size_bytes);
      out.varint(entry.vertex_count);
      out.varint(entry.triangle_count);
      break;
  }
}

CatalogueEntry read_entry(WireReader& in) {
  CatalogueEntry entry;
  entry.name = in.text(kMaxNameBytes);
  if (entry.name.empty()) in.reject();
  const std::uint8_t state = in.u8();
  switch (state) {
    case 0:
      entry.digest = read_digest(in);
      entry.size_bytes = in.varint();
      entry.vertex_count = in.varint();
      entry.triangle_count = in.varint();
      break;
    case 1:
      entry.permille = in.u16();
      if (entry.permille > 1000) in.reject();
      break;
    case 2: entry.reason = in.text(kMaxTextBytes); break;
    default: in.reject();
  }
  entry.state = static_cast<ModelState>(state);
  return entry;
}

}  // namespace

std::string name(ErrorCode code) {
  switch (code) {
    case ErrorCode::version_mismatch: return "version mismatch";
    case ErrorCode::bad_frame: return "bad frame";
    case ErrorCode::bad_message: return "bad message";
    case ErrorCode::unexpected_message: return "unexpected message";
    case ErrorCode::limit: return "limit";
    case ErrorCode::unknown_model: return "unknown model";
    case ErrorCode::model_failed: return "model failed";
    case ErrorCode::want_out_of_range: return "want out of range";
    case ErrorCode::handshake_timeout: return "handshake timeout";
    case ErrorCode::idle_timeout: return "idle timeout";
    case ErrorCode::stalled: return "stalled";
    case ErrorCode::server_full: return "server full";
    case ErrorCode::shutting_down: return "shutting down";
    case ErrorCode::internal: return "internal error";
  }
  return "error " + std::to_string(static_cast<unsigned>(code));
}

ErrorKind error_kind(ErrorCode code) {
  switch (code) {
    case ErrorCode::version_mismatch: return ErrorKind::unsupported;
    case ErrorCode::bad_frame:
    case ErrorCode::bad_message:
    case ErrorCode::unexpected_message:
    case ErrorCode::model_failed: return ErrorKind::bad_input;
    case ErrorCode::limit:
    case ErrorCode::server_full: return ErrorKind::limit;
    case ErrorCode::unknown_model: return ErrorKind::not_found;
    case ErrorCode::want_out_of_range: return ErrorKind::usage;
    case ErrorCode::handshake_timeout:
    case ErrorCode::idle_timeout:
    case ErrorCode::stalled:
    case ErrorCode::shutting_down:
    case ErrorCode::internal: return ErrorKind::network;
  }
  return ErrorKind::network;
}

void encode(const Hello& message, std::vector<std::byte>& out) {
  frame(FrameType::hello, out, [&](WireWriter& w) {
    w.u32(kProtocolMagic);
    w.u16(message.version_min);
    w.u16(message.version_max);
    w.u32(message.features);
  });
}

Result<Hello> decode_hello(Bytes payload) {
  WireReader in(payload);
  if (in.u32() != kProtocolMagic) in.reject();
  Hello message;
  message.version_min = in.u16();
  message.version_max = in.u16();
  message.features = in.u32();
  if (message.version_min > message.version_max) in.reject();
  in.rest();  // later versions may say more; the handshake is the one message that has to be readable by all
  return finish(FrameType::hello, in, message);
}

void encode(const Welcome& message, std::vector<std::byte>& out) {
  frame(FrameType::welcome, out, [&](WireWriter& w) {
    w.u32(kProtocolMagic);
    w.u16(message.version);
    w.u32(message.features);
    w.u32(message.idle_timeout_ms);
  });
}

Result<Welcome> decode_welcome(Bytes payload) {
  WireReader in(payload);
  if (in.u32() != kProtocolMagic) in.reject();
  Welcome message;
  message.version = in.u16();
  message.features = in.u32();
  message.idle_timeout_ms = in.u32();
  return finish(FrameType::welcome, in, message);
}

void encode(const Open& message, std::vector<std::byte>& out) {
  frame(FrameType::open, out, [&](WireWriter& w) {
    w.text(message.model, kMaxNameBytes);
    w.u8(message.have ? 1 : 0);
    if (!message.have) return;
    write_digest(message.have->digest, w);
    w.u8(static_cast<std::uint8_t>((message.have->head ? 1 : 0) | (message.have->index ? 2 : 0)));
    write_runs(message.have->cells, w);
  });
}

Result<Open> decode_open(Bytes payload) {
  WireReader in(payload);
  Open message;
  message.model = in.text(kMaxNameBytes);
  if (message.model.empty()) in.reject();
  const std::uint8_t has_have = in.u8();
  if (has_have > 1) in.reject();
  if (in.ok() && has_have == 1) {
    Have have;
    have.digest = read_digest(in);
    const std::uint8_t flags = in.u8();
    if (flags > 3) in.reject();
    have.head = (flags & 1U) != 0;
    have.index = (flags & 2U) != 0;
    have.cells = read_runs(in);
    message.have = std::move(have);
  }
  return finish(FrameType::open, in, std::move(message));
}

void encode(const Wants& message, std::vector<std::byte>& out) {
  frame(FrameType::wants, out, [&](WireWriter& w) {
    w.varint(message.epoch);
    write_runs(message.runs, w);
  });
}

Result<Wants> decode_wants(Bytes payload) {
  WireReader in(payload);
  Wants message;
  message.epoch = in.varint32();
  message.runs = read_runs(in);
  return finish(FrameType::wants, in, std::move(message));
}

void encode(const Release& message, std::vector<std::byte>& out) {
  frame(FrameType::release, out, [&](WireWriter& w) { write_runs(message.runs, w); });
}

Result<Release> decode_release(Bytes payload) {
  WireReader in(payload);
  Release message;
  message.runs = read_runs(in);
  return finish(FrameType::release, in, std::move(message));
}

void encode(const Credit& message, std::vector<std::byte>& out) {
  frame(FrameType::credit, out, [&](WireWriter& w) { w.varint(message.bytes); });
}

Result<Credit> decode_credit(Bytes payload) {
  WireReader in(payload);
  const Credit message{in.varint(kMaxCredit)};
  return finish(FrameType::credit, in, message);
}

void encode(FrameType ping_or_pong, const Ping& message, std::vector<std::byte>& out) {
  frame(ping_or_pong, out, [&](WireWriter& w) { w.u64(message.token); });
}

Result<Ping> decode_ping(Bytes payload) {
  WireReader in(payload);
  const Ping message{in.u64()};
  return finish(FrameType::ping, in, message);
}

void encode_catalogue(const std::vector<CatalogueEntry>& entries, std::vector<std::byte>& out) {
  constexpr std::size_t kFixedBytes = 8;  // the flag and the count before the entries
  std::vector<std::byte> packed;
  std::vector<std::byte> one;
  std::size_t count = 0;
  const auto flush = [&](bool last) {
    frame(FrameType::catalogue, out, [&](WireWriter& w) {
      w.u8(last ? 1 : 0);
      w.varint(count);
      w.bytes(packed);
    });
    packed.clear();
    count = 0;
  };
  for (const CatalogueEntry& entry : entries) {
    one.clear();
    WireWriter writer(one);
    write_entry(entry, writer);
    if (packed.size() + one.size() + kFixedBytes > kMaxCatalogueFrameBytes) flush(false);
    packed.insert(packed.end(), one.begin(), one.end());
    ++count;
  }
  flush(true);
}

Result<CataloguePart> decode_catalogue(Bytes payload) {
  WireReader in(payload);
  CataloguePart message;
  const std::uint8_t last = in.u8();
  if (last > 1) in.reject();
  message.last = last == 1;
  const std::uint64_t count = in.varint(kMaxCatalogueFrameBytes);
  for (std::uint64_t i = 0; i < count && in.ok(); ++i) message.entries.push_back(read_entry(in));
  return finish(FrameType::catalogue, in, std::move(message));
}

void encode(const Building& message, std::vector<std::byte>& out) {
  frame(FrameType::building, out, [&](WireWriter& w) { w.u16(message.permille); });
}

Result<Building> decode_building(Bytes payload) {
  WireReader in(payload);
  const Building message{in.u16()};
  if (message.permille > 1000) in.reject();
  return finish(FrameType::building, in, message);
}

void encode(const Opened& message, std::vector<std::byte>& out) {
  frame(FrameType::opened, out, [&](WireWriter& w) {
    w.u8(message.resumed ? 1 : 0);
    write_digest(message.digest, w);
    w.varint(message.cell_count);
    w.varint(message.segment_total);
    w.varint(message.head_size_bytes);
    w.varint(message.index_size_bytes);
    w.varint(message.size_bytes);
    w.varint(message.vertex_count);
    w.varint(message.triangle_count);
  });
}

Result<Opened> decode_opened(Bytes payload) {
  WireReader in(payload);
  Opened message;
  const std::uint8_t resumed = in.u8();
  if (resumed > 1) in.reject();
  message.resumed = resumed == 1;
  message.digest = read_digest(in);
  message.cell_count = static_cast<std::uint32_t>(in.varint(kMaxCells));
  message.segment_total = in.varint(std::uint64_t{kMaxCells} * kMaxSegmentsPerCell);
  message.head_size_bytes = in.varint(kMaxHeadBytes);
  message.index_size_bytes = in.varint(kMaxHeadBytes);
  message.size_bytes = in.varint();
  message.vertex_count = in.varint();
  message.triangle_count = in.varint();
  return finish(FrameType::opened, in, message);
}

void encode(const WantsDone& message, std::vector<std::byte>& out) {
  frame(FrameType::wants_done, out, [&](WireWriter& w) {
    w.varint(message.epoch);
    w.varint(message.release_count);
  });
}

Result<WantsDone> decode_wants_done(Bytes payload) {
  WireReader in(payload);
  WantsDone message;
  message.epoch = in.varint32();
  message.release_count = in.varint32();
  return finish(FrameType::wants_done, in, message);
}

void encode(const Degraded& message, std::vector<std::byte>& out) {
  frame(FrameType::degraded, out, [&](WireWriter& w) {
    w.u8(static_cast<std::uint8_t>(message.reason));
    w.text(message.text, kMaxTextBytes);
  });
}

// Reasons of later versions pass through: the text says what they mean.
Result<Degraded> decode_degraded(Bytes payload) {
  WireReader in(payload);
  Degraded message;
  message.reason = static_cast<DegradedReason>(in.u8());
  message.text = in.text(kMaxTextBytes);
  return finish(FrameType::degraded, in, std::move(message));
}

void encode(const ErrorMessage& message, std::vector<std::byte>& out) {
  frame(FrameType::error, out, [&](WireWriter& w) {
    w.u16(static_cast<std::uint16_t>(message.code));
    w.u8(message.fatal ? 1 : 0);
    w.u32(message.detail);
    w.text(message.text, kMaxTextBytes);
  });
}

Result<ErrorMessage> decode_error(Bytes payload) {
  WireReader in(payload);
  ErrorMessage message;
  message.code = static_cast<ErrorCode>(in.u16());
  const std::uint8_t fatal = in.u8();
  if (fatal > 1) in.reject();
  message.fatal = fatal == 1;
  message.detail = in.u32();
  message.text = in.text(kMaxTextBytes);
  return finish(FrameType::error, in, std::move(message));
}

Result<BlobPart> decode_blob_part(FrameType type, Bytes payload) {
  WireReader in(payload);
  BlobPart part;
  part.offset_bytes = in.varint32();
  part.bytes = in.rest();
  if (part.bytes.size() > kMaxChunkBytes) in.reject();
  return finish(type, in, part);
}

void add_to_batch(std::uint32_t cell, std::uint32_t segment_count, std::vector<BatchRun>& runs) {
  if (!runs.empty() && runs.back().segment_count == segment_count &&
      runs.back().first_cell + runs.back().cell_count == cell) {
    ++runs.back().cell_count;
  } else {
    runs.push_back({cell, 1, segment_count});
  }
}

// Per run: 2 x zigzag distance from the end of the last run + more. Without more it is one segment of one cell; with it
// follow 2 x (segments - 1) + several cells, and if there are several, cells - 2.
void write_batch_fields(std::uint32_t release_count, std::span<const BatchRun> runs, WireWriter& out) {
  out.varint(release_count);
  out.varint(runs.size());
  std::int64_t expected = 0;
  for (const BatchRun& run : runs) {
    const bool several = run.cell_count > 1;
    const bool more = several || run.segment_count > 1;
    out.varint(2 * zigzag(std::int64_t{run.first_cell} - expected) + (more ? 1 : 0));
    if (more) out.varint(2 * (std::uint64_t{run.segment_count} - 1) + (several ? 1 : 0));
    if (several) out.varint(run.cell_count - 2);
    expected = std::int64_t{run.first_cell} + run.cell_count;
  }
}

Result<SegmentBatch> decode_segments(Bytes payload) {
  WireReader in(payload);
  SegmentBatch batch;
  batch.release_count = in.varint32();
  const auto count = static_cast<std::size_t>(in.varint(kMaxChunkBytes));
  if (count == 0 || count > in.remaining() / 2) in.reject();  // each run takes a byte, and each segment one
  if (in.ok()) batch.runs.reserve(count);
  std::int64_t expected = 0;
  std::uint64_t segments = 0;
  for (std::size_t i = 0; i < count && in.ok(); ++i) {
    const std::uint64_t head = in.varint(4ULL * kMaxCells + 3);
    const std::uint64_t more = (head & 1U) != 0 ? in.varint(2ULL * kMaxSegmentsPerCell) : 0;
    const std::uint64_t cells = (more & 1U) != 0 ? in.varint(kMaxCells) + 2 : 1;
    const std::uint64_t each = more / 2 + 1;
    if ((head & 1U) != 0 && more == 0) in.reject();  // has a shorter form
    const std::int64_t first = expected + unzigzag(head >> 1);
    expected = first + static_cast<std::int64_t>(cells);
    segments += cells * each;
    if (first < 0 || expected > std::int64_t{kMaxCells} || segments > in.remaining()) in.reject();
    if (in.ok()) {
      batch.runs.push_back(
          {static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(cells), static_cast<std::uint32_t>(each)});
    }
  }
  batch.bytes = in.rest();
  if (batch.bytes.size() > kMaxChunkBytes || segments > batch.bytes.size()) in.reject();
  return finish(FrameType::segments, in, std::move(batch));
}

Result<SegmentPart> decode_segment_part(Bytes payload) {
  WireReader in(payload);
  SegmentPart part;
  part.release_count = in.varint32();
  part.cell = static_cast<std::uint32_t>(in.varint(kMaxCells - 1));
  part.offset_bytes = static_cast<std::uint32_t>(in.varint(kMaxSegmentBytes));
  part.bytes = in.rest();
  if (part.bytes.size() > kMaxChunkBytes || part.bytes.empty()) in.reject();
  return finish(FrameType::segment_part, in, part);
}

}  // namespace fanstream
