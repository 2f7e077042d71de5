// Arbitrary bytes into the frame reader of either side, in arbitrary pieces, and every frame's payload into its
// decoder. Input: one byte (bit 0 the side, the rest the size of the pieces), then the stream. What is decoded is
// encoded and decoded again, and must not change.
#include <algorithm>
#include <cstdlib>
#include <vector>

#include "protocol/messages.h"

using namespace fanstream;

namespace {

void require(bool condition) {
  if (!condition) std::abort();
}

template <class Message>
void round_trip(const Result<Message>& first, Result<Message> (*decode)(Bytes)) {
  if (!first) return;
  std::vector<std::byte> once;
  encode(*first, once);
  const Result<Message> second = decode(Bytes(once).subspan(kFrameHeaderBytes));
  require(second.has_value());
  std::vector<std::byte> twice;
  encode(*second, twice);
  require(once == twice);
}

// A batch has one form, and no more segments than bytes.
void round_trip_batch(Bytes payload) {
  const Result<SegmentBatch> batch = decode_segments(payload);
  if (!batch) return;
  std::uint64_t segments = 0;
  for (const BatchRun& run : batch->runs) segments += std::uint64_t{run.cell_count} * run.segment_count;
  require(segments > 0 && segments <= batch->bytes.size());
  std::vector<std::byte> again;
  WireWriter writer(again);
  write_batch_fields(batch->release_count, batch->runs, writer);
  writer.bytes(batch->bytes);
  require(std::equal(again.begin(), again.end(), payload.begin(), payload.end()));
}

void decode_payload(FrameType type, Bytes view) {
  // An exactly sized copy, so that the sanitizer sees every over-read.
  const std::vector<std::byte> payload(view.begin(), view.end());
  switch (type) {
    case FrameType::hello: return round_trip(decode_hello(payload), decode_hello);
    case FrameType::welcome: return round_trip(decode_welcome(payload), decode_welcome);
    case FrameType::open: return round_trip(decode_open(payload), decode_open);
    case FrameType::wants: return round_trip(decode_wants(payload), decode_wants);
    case FrameType::release: return round_trip(decode_release(payload), decode_release);
    case FrameType::credit: return round_trip(decode_credit(payload), decode_credit);
    case FrameType::building: return round_trip(decode_building(payload), decode_building);
    case FrameType::opened: return round_trip(decode_opened(payload), decode_opened);
    case FrameType::wants_done: return round_trip(decode_wants_done(payload), decode_wants_done);
    case FrameType::degraded: return round_trip(decode_degraded(payload), decode_degraded);
    case FrameType::error: return round_trip(decode_error(payload), decode_error);
    case FrameType::ping:
    case FrameType::pong: (void)decode_ping(payload); return;
    case FrameType::catalogue: (void)decode_catalogue(payload); return;
    case FrameType::head_data:
    case FrameType::index_data: (void)decode_blob_part(type, payload); return;
    case FrameType::segments: return round_trip_batch(payload);
    case FrameType::segment_part: (void)decode_segment_part(payload); return;
    case FrameType::list: return;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return 0;
  const Receiver receiver = (data[0] & 1U) != 0 ? Receiver::client : Receiver::server;
  const std::size_t piece = 1 + (data[0] >> 1U) * 7U;
  const Bytes stream = std::as_bytes(std::span(data + 1, size - 1));
  FrameReader reader(receiver);
  for (std::size_t at = 0; at < stream.size(); at += piece) {
    reader.push(stream.subspan(at, std::min(piece, stream.size() - at)));
    for (auto frame = reader.next(); frame && *frame; frame = reader.next()) {
      require((*frame)->payload.size() <= max_payload_bytes((*frame)->type, receiver).value());
      decode_payload((*frame)->type, (*frame)->payload);
    }
  }
  // Any payload for any decoder, whatever the frame reader would have thought of it.
  if (!stream.empty()) decode_payload(static_cast<FrameType>(stream[0]), stream.subspan(1));
  return 0;
}
