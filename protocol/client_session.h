// The client's end of one connection as a state machine: bytes in, events out, bytes to send. No sockets, clocks or
// threads. Distrusts the server: every limit, order, size and checksum is checked. Not thread safe.
//
//   driver loop: pending_output() -> write -> written(); receive(); next_event() until empty; tick() at least every
//   second while waiting. A longer gap between ticks counts as the driver having been away, not as the server being
//   slow.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "protocol/link_estimate.h"
#include "protocol/messages.h"
#include "protocol/segment_table.h"

namespace fanstream {

struct ClientSessionOptions {
  std::uint16_t version_min = kProtocolVersionMin;
  std::uint16_t version_max = kProtocolVersionMax;
  // Blob bytes the server may have under way to us. Precondition: at least 3/2 * kMaxChunkBytes. Memory and lateness
  // against throughput: bandwidth times round trip is needed (4 MiB: 100 ms at 330 Mbit/s), and four thirds of it,
  // since credit is granted again by quarters; after a change of wants at most so much of the old ones still arrives,
  // whatever queues the network has.
  std::uint32_t window_bytes = 4U << 20;
  // The window follows the link and stays below window_bytes: bandwidth times round trip + 48 KiB, as far as they can
  // be measured; twice the former until the bandwidth grows no more. For those who change their wants and would
  // otherwise wait for what network queues hold of the old ones. Pings once a second.
  bool adaptive_window = false;
  std::uint64_t max_head_bytes = 256ULL << 20;  // head and index, each: larger ones are refused before they arrive
  TimeMs stall_timeout_ms = 30'000;             // something is awaited and no frame or KiB of one comes
  TimeMs ping_interval_ms = 10'000;             // silence after which the server is asked for a sign of life
};

namespace event {
struct Welcomed {
  std::uint16_t version = 0;
};
struct Catalogue {
  std::vector<CatalogueEntry> entries;
};
struct BuildingModel {
  double fraction = 0;
};
struct ModelOpened {
  Opened model;  // not resumed although asked: what is held is of another asset, drop it
};
// Complete; the bytes are at ClientSession::head() and index().
struct HeadComplete {};
struct IndexComplete {};
struct SegmentArrived {
  std::uint32_t cell = 0;
  std::uint32_t segment = 0;
  Bytes bytes;  // valid until the next non-const call
};
// All that the list names is held, but for what was released after it. A server that says so without having sent it
// has broken the protocol.
struct WantsServed {
  std::uint32_t epoch = 0;
};
// A request was refused, the session goes on.
struct Refused {
  ErrorCode code = ErrorCode::internal;
  std::uint32_t detail = 0;
  std::string text;
};
struct ServerDegraded {
  DegradedReason reason = DegradedReason::none;
  std::string text;
};
// The session is over. What was received stays usable.
struct Failed {
  Error error;
};
}  // namespace event

using ClientEvent = std::variant<event::Welcomed, event::Catalogue, event::BuildingModel, event::ModelOpened,
                                 event::HeadComplete, event::IndexComplete, event::SegmentArrived, event::WantsServed,
                                 event::Refused, event::ServerDegraded, event::Failed>;

class ClientSession {
 public:
  ClientSession(const ClientSessionOptions& options, TimeMs now_ms);

  // Requests. Errors (usage, limit) mean that nothing was sent. Precondition of list(): Welcomed has been seen.
  void list();
  // One model per session. After Refused another may be opened. May be called at once: then it goes out with the hello,
  // a round trip earlier.
  Result<void> open(std::string model, std::optional<Have> have = {});
  // What the index says of segments, to be told as soon as the index is complete (or held, see Have): without it no
  // segment can be taken. Fails (bad_input) if it is not of the model that was opened. The caller may learn more cells
  // (SegmentTable::learn_cell) whenever a segment that tells of them has been given out, before the next call here;
  // until then nothing may be wanted of them that could come sooner. Precondition: index_complete().
  Result<void> set_segment_table(std::shared_ptr<const SegmentTable> table);
  // Segments 0 .. prefix-1 of each cell, in list order; those already sent are left out. Replaces the list before it,
  // also one that has not left this machine yet. Returns its epoch. Precondition: open() succeeded.
  Result<std::uint32_t> set_wants(std::vector<CellRun> runs);
  // The segments from `prefix` on of these cells were dropped and may be wanted again. Set wants after it, not before:
  // of a list before it they need not come. Any number of runs: what does not fit into one frame goes in several.
  Result<void> release(const std::vector<CellRun>& runs);

  std::span<std::byte> prepare(std::size_t size_bytes) { return reader_.prepare(size_bytes); }
  void commit(std::size_t size_bytes, TimeMs now_ms);
  void receive(Bytes bytes, TimeMs now_ms);
  // Decodes lazily: a caller that does not ask grants no further credit, which slows the server down. After Failed:
  // nothing.
  std::optional<ClientEvent> next_event();
  // The transport ended. Becomes Failed after what was received before has been handed out.
  void transport_closed(std::string_view why);

  Bytes pending_output();  // valid until the next non-const call
  void written(std::size_t size_bytes);
  void tick(TimeMs now_ms);

  bool welcomed() const { return welcomed_; }
  bool failed() const { return failure_.has_value(); }
  const std::optional<Opened>& model() const { return model_; }
  // Received, or held as stated at open.
  bool head_complete() const { return head_told_; }
  bool index_complete() const { return index_told_; }
  Bytes head() const { return head_; }
  Bytes index() const { return index_; }
  // How many segments of a cell have been given out or were held at open; empty ones that follow them count. Before the
  // table is set, kAllSegments for what was held completely. Precondition: opened.
  std::uint32_t held_prefix(std::uint32_t cell) const {
    return table_ ? table_->next_to_send(cell, held_[cell]) : held_[cell];
  }
  std::uint32_t window_bytes() const { return window_bytes_; }
  std::uint32_t set_epoch() const { return set_epoch_; }  // of the newest list; 0: none was set
  // A list is not served completely yet.
  bool wants_outstanding() const { return set_epoch_ != 0 && served_epoch_ != set_epoch_; }
  std::uint64_t received_bytes() const { return received_bytes_; }
  std::uint64_t received_segments() const { return received_segments_; }  // given out
  std::uint64_t stale_segments() const { return stale_segments_; }        // released while they were under way
  // "while waiting for ...": what the session is at, for messages.
  std::string_view awaiting() const;

 private:
  std::optional<ClientEvent> handle(const FrameView& frame);
  std::optional<ClientEvent> handle_welcome(Bytes payload);
  std::optional<ClientEvent> handle_catalogue(Bytes payload);
  std::optional<ClientEvent> handle_opened(Bytes payload);
  std::optional<ClientEvent> handle_blob(FrameType type, Bytes payload);
  std::optional<ClientEvent> handle_segments(Bytes payload);
  std::optional<ClientEvent> handle_segment_part(Bytes payload);
  Result<std::uint32_t> next_of(FrameType type, std::uint32_t cell);
  Result<void> apply_releases(FrameType type, std::uint32_t release_count);
  Result<void> resolve_arrived();
  std::optional<ClientEvent> give_arrived();
  void note_wanted(const std::vector<CellRun>& runs);
  std::optional<CellPrefix> first_missing() const;
  std::optional<ClientEvent> handle_wants_done(Bytes payload);
  std::optional<ClientEvent> handle_error(Bytes payload);
  std::optional<ClientEvent> completed_blob();
  ClientEvent fail_with(ErrorKind kind, std::string message);
  Error unexpected_error(FrameType type, std::string_view why) const;
  ClientEvent unexpected(FrameType type, std::string_view why);
  void grant_up_to_window();
  void measure_arrival(std::size_t size_bytes, TimeMs now_ms);
  void ping(TimeMs now_ms);
  bool spend_credit(std::size_t size_bytes);
  bool awaits_something() const;

  ClientSessionOptions options_;
  FrameReader reader_{Receiver::client};
  std::vector<std::byte> output_;
  std::size_t output_sent_ = 0;
  std::vector<std::byte> wants_frame_;  // the newest list, not yet in output_
  std::optional<Error> failure_;
  bool failure_told_ = false;
  std::optional<std::string> closed_;  // the transport ended, and why

  bool welcomed_ = false;
  bool list_pending_ = false;
  std::uint64_t catalogues_to_come_ = 0;  // at most
  std::vector<CatalogueEntry> catalogue_;
  std::optional<std::string> opening_;
  std::optional<Have> have_;
  std::optional<Opened> model_;
  std::vector<std::byte> head_, index_;
  bool head_told_ = false, index_told_ = false;
  std::shared_ptr<const SegmentTable> table_;
  std::vector<std::uint32_t> held_;  // given out, or held at open
  std::vector<std::uint32_t>
      sent_;  // what the server has sent as far as it has arrived: more than held after a release
  std::vector<std::uint32_t> wanted_;          // the largest prefix that any list has named
  std::vector<CellRun> list_;                  // the newest
  std::vector<CellRun> released_since_list_;   // so that the server may not have sent it again
  std::vector<CellRun> early_wants_;           // of lists set before the model was opened
  bool early_wants_many_ = false;              // too many to keep: anything may come
  std::deque<std::vector<CellRun>> releases_;  // that the server may not have read yet, oldest first
  std::uint32_t releases_made_ = 0;
  struct Arrived {
    std::uint32_t cell, segment, size_bytes;
  };
  std::vector<Arrived> arrived_;  // segments whose bytes are in arrived_bytes_, from next_arrived_ on not yet given out
  std::size_t next_arrived_ = 0, next_arrived_at_ = 0;
  // Of that frame: from this segment of this run on it is not yet known what they are; the bytes of those that are.
  std::vector<BatchRun> unresolved_;
  std::size_t unresolved_run_ = 0, resolved_bytes_ = 0;
  std::uint32_t unresolved_segment_ = 0;
  std::vector<std::byte> arrived_bytes_;
  std::optional<Arrived> part_;  // under way, of which arrived_bytes_ holds the beginning
  std::uint32_t set_epoch_ = 0, served_epoch_ = 0, sent_epoch_ = 0;

  std::uint64_t credit_bytes_ = 0;  // granted and not used up by what arrived
  std::uint64_t granted_unsent_bytes_ = 0;
  std::uint32_t window_bytes_;
  LinkEstimate link_;
  std::uint64_t received_bytes_ = 0;
  std::uint64_t received_segments_ = 0, stale_segments_ = 0;

  TimeMs last_tick_ms_;
  TimeMs last_progress_ms_;
  TimeMs last_received_ms_;
  TimeMs last_ping_ms_ = 0;
  bool progressed_ = false;
  std::size_t partial_bytes_ = 0;  // of the frame under way, as far as they have counted as progress
};

}  // namespace fanstream
