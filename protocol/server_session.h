// The server's end of one connection as a state machine: bytes in, events out, and bytes to send chosen as late as
// possible. No sockets, clocks or threads: the driver passes the time (any monotonic milliseconds) and moves the bytes.
// Not thread safe.
//
//   driver loop: receive() while wants_to_receive(); next_event() until empty, answering each, after receive() and
//   after written(); while wants_to_send() and the transport can take bytes: next_write(), write, written(); tick()
//   about once a second; close the transport once finished().
//
// Cells that a client names in lists are walked through 64 Ki at a time, once for every next_write(). While a long
// release or statement of what is held is not yet worked through, nothing further is received or chosen.
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

#include "common/asset/segment_source.h"
#include "protocol/messages.h"
#include "protocol/send_plan.h"

namespace fanstream {

struct ServerSessionOptions {
  TimeMs handshake_timeout_ms = 10'000;  // from connection to a complete hello
  // Of these three, time in which the session does not want to receive does not count.
  TimeMs frame_timeout_ms = 30'000;    // from the first to the last byte of any other frame
  TimeMs ping_interval_ms = 20'000;    // silence after which the client is asked for a sign of life
  TimeMs idle_timeout_ms = 90'000;     // silence after which it is given up
  TimeMs stall_timeout_ms = 60'000;    // bytes to send and the client takes none: given up
  TimeMs no_credit_notice_ms = 5'000;  // wanted segments wait for credit: the client is told
  TimeMs building_repeat_ms = 2'000;   // 'building' is repeated at least so often
  // Data chosen for one write. Larger costs lateness on slow lines (32 KiB is 26 ms at 10 Mbit/s), smaller costs system
  // calls.
  std::size_t write_batch_bytes = 32 * 1024;
};

// The driver answers with send_catalogue().
struct ListRequested {};
// The driver answers with open_building() any number of times, then open_ready() or open_failed().
struct OpenRequested {
  std::string model;
};
using ServerEvent = std::variant<ListRequested, OpenRequested>;

class ServerSession {
 public:
  ServerSession(const ServerSessionOptions& options, TimeMs now_ms);

  // Room for bytes from the transport, then how many came. Or receive(), which copies.
  std::span<std::byte> prepare(std::size_t size_bytes) { return reader_.prepare(size_bytes); }
  void commit(std::size_t size_bytes, TimeMs now_ms);
  void receive(Bytes bytes, TimeMs now_ms);
  // False while the client leaves our answers unread, and while what it sent before is being worked through: the driver
  // then stops reading, so that no flood can fill our memory or time.
  bool wants_to_receive() const;
  // Works through what was received until something needs the driver, or until the session does not want to receive:
  // what it has got of frames then waits. Violations of the protocol queue a fatal error.
  std::optional<ServerEvent> next_event(TimeMs now_ms);

  void send_catalogue(const std::vector<CatalogueEntry>& entries);
  void open_building(double fraction, TimeMs now_ms);  // 0 to 1
  void open_ready(std::shared_ptr<const SegmentSource> source);
  void open_failed(ErrorCode code, std::string_view text);
  // The model whose open is still to be answered.
  const std::optional<std::string>& pending_open() const { return pending_open_; }

  // True if next_write() may give bytes or has cells to walk through. Then it may give none.
  bool wants_to_send() const;
  // Fills `buffers` with what to write now, in order: about write_batch_bytes of frames. Blobs come straight from the
  // source, except that pieces below kJoinBytes are joined in `scratch`, where a copy is cheaper than one more buffer
  // for the kernel. Returns how many buffers; they and `scratch` must stay as they are until written(). 0 means go on
  // with next_event() and ask again later.
  static constexpr std::size_t kJoinBytes = 1024;
  std::size_t next_write(std::span<Bytes> buffers, std::vector<std::byte>& scratch);
  // How many of those bytes the transport took. The rest comes again.
  void written(std::size_t size_bytes, TimeMs now_ms);

  // Timeouts and keep-alive.
  void tick(TimeMs now_ms);
  // Says goodbye: drops what is not yet under way, queues a fatal error. finished() becomes true when it is written.
  void close(ErrorCode code, std::string_view text);
  // Nothing more will be sent or taken: close the transport, with the error having been delivered or beyond hope.
  bool finished() const { return closing_ && (aborted_ || (in_flight_.empty() && control_.empty())); }
  bool closing() const { return closing_; }
  // Why the session ended, for a log; empty while it lives.
  const std::string& close_reason() const { return close_reason_; }

  std::uint64_t sent_bytes() const { return sent_bytes_; }
  std::uint64_t sent_segments() const { return sent_segments_; }
  std::uint64_t credit_bytes() const { return credit_bytes_; }

 private:
  static constexpr std::size_t kEntriesPerWrite = 64 * 1024;  // cells of lists before others get their turn
  struct OutFrame {
    std::optional<DataFrame> data;
    std::optional<DataFrameHeader> header;  // of data with a blob
    std::vector<std::byte> bytes;           // otherwise: joined segments, control frames, wants done
    bool wants_done = false;
    bool answers_list = false;  // ends with a catalogue
    bool handed = false;        // given out by next_write() and not yet reported
    std::size_t written_bytes = 0;
    Bytes front() const { return header ? header->bytes() : Bytes(bytes); }
    std::size_t size_bytes() const { return front().size() + (data ? data->blob.size() : 0); }
  };

  std::optional<ServerEvent> handle(const FrameView& frame, TimeMs now_ms);
  std::optional<ServerEvent> handle_hello(Bytes payload);
  std::optional<ServerEvent> handle_open(Bytes payload);
  void handle_wants(Bytes payload);
  void handle_release(Bytes payload);
  void handle_credit(Bytes payload);
  void work_through_cells();
  void refuse_open(ErrorCode code, const std::string& model, std::string_view text);
  void finish_open();
  void refuse(ErrorCode code, std::string_view text, std::uint32_t detail = 0);  // non-fatal
  void take_back_unsent();
  void fill();
  bool choose_one();
  void add_data(DataFrame frame);
  void pass_time(TimeMs now_ms);
  void check_sending(TimeMs now_ms);
  void abort(std::string reason);

  ServerSessionOptions options_;
  FrameReader reader_{Receiver::server};
  bool welcomed_ = false;
  bool list_pending_ = false;      // the answer is not wholly written
  bool catalogue_queued_ = false;  // in control_
  bool open_attempted_ = false;
  std::optional<std::string> pending_open_;
  std::optional<Have> have_;
  std::optional<Opened> opening_;  // to be said when all cells are walked through
  std::string opening_model_;
  std::optional<Wants> early_wants_;  // arrived before the model was ready
  SendPlan plan_;
  std::uint32_t last_epoch_ = 0;
  std::uint64_t credit_bytes_ = 0;
  bool blocked_on_credit_ = false;
  bool input_waits_ = false;  // next_event() stopped before the end of what was received
  std::size_t entries_left_ = kEntriesPerWrite;
  std::uint32_t refusals_ = 0;
  int last_permille_ = -1;

  std::deque<OutFrame> in_flight_;   // chosen, in sending order
  std::size_t in_flight_bytes_ = 0;  // not yet written
  std::vector<std::byte> control_;   // to be sent before any further data
  bool closing_ = false;
  bool aborted_ = false;
  std::string close_reason_;
  std::uint64_t sent_bytes_ = 0;
  std::uint64_t sent_segments_ = 0;

  TimeMs started_ms_;
  TimeMs last_received_ms_;  // this and frame_begun_ms_ move along while nothing is received on purpose
  TimeMs passed_ms_;
  TimeMs last_ping_ms_ = 0;
  TimeMs last_building_ms_ = 0;
  std::optional<TimeMs> frame_begun_ms_;
  std::uint64_t frame_begun_offset_ = 0;
  std::optional<TimeMs> unsent_since_ms_;
  std::optional<TimeMs> no_credit_since_ms_;
  bool no_credit_told_ = false;
};

}  // namespace fanstream
