// A model streamed from a server over as many connections as it takes. When one is lost, at whatever byte, the next
// states the asset's digest and what is held of it, and goes on: nothing that was given out comes again. Starts no
// threads and has no global state; everything happens inside the calls.
//
//   start(); next_event() until Opened, HeadComplete, IndexComplete; set_segment_table(); set_wants(); next_event() ...
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <variant>
#include <vector>

#include "client/net/stream_client.h"

namespace fanstream {

struct ReconnectOptions {
  StreamClientOptions client;  // connect_timeout_ms holds for each attempt, `stop` ends every call within 0.1 s
  // The wait before the n-th attempt is first_retry_ms x 2^(n-1), at most max_retry_ms, times a random number from 0.5
  // to 1, so that the clients of a server that restarts do not come back all at once.
  TimeMs first_retry_ms = 200;
  TimeMs max_retry_ms = 10'000;
  // Since the last progress (a head, an index, a segment, a list served) over connections that failed; 0: one
  // connection is all.
  TimeMs give_up_after_ms = 120'000;
  std::uint64_t jitter_seed = 0;  // 0: taken from the clock and the address of the client
  // Told, in a sentence for people, when the connection is lost, before each attempt, and when it is there again: at
  // once, inside whatever call is waiting.
  std::function<void(const std::string&)> on_notice = {};
};

// What is already held of an asset, of an earlier session.
struct HeldAsset {
  Digest digest{};
  std::vector<std::byte> head, index;   // empty: not held
  std::vector<std::uint32_t> prefixes;  // of each cell; empty: nothing. Needs the index
};

namespace event {
// The connection ended. What follows is Retrying, or next_event() gives the error if there is nothing left to try.
struct ConnectionLost {
  Error reason;
};
struct Retrying {
  TimeMs delay_ms = 0;
  std::uint32_t attempt = 0;  // since the last progress, from 1
  std::string reason;         // why the attempt before it failed
};
// Connected again to the same asset.
struct ConnectionResumed {
  std::uint32_t attempts = 0;
};
}  // namespace event

std::string text_of(const event::ConnectionLost& lost);
std::string text_of(const event::Retrying& retrying);
std::string text_of(const event::ConnectionResumed& resumed);

using ReconnectingEvent =
    std::variant<event::BuildingModel, event::ModelOpened, event::HeadComplete, event::IndexComplete,
                 event::SegmentArrived, event::WantsServed, event::Refused, event::ServerDegraded,
                 event::ConnectionLost, event::Retrying, event::ConnectionResumed>;

// Not thread safe.
class ReconnectingClient {
 public:
  // Begins to connect; does not wait but for the host's name to be looked up. Errors: usage (no model in the address).
  static Result<std::unique_ptr<ReconnectingClient>> start(const ServerAddress& address,
                                                           const ReconnectOptions& options = {},
                                                           std::optional<HeldAsset> held = {});
  ReconnectingClient(const ReconnectingClient&) = delete;
  ReconnectingClient& operator=(const ReconnectingClient&) = delete;
  ~ReconnectingClient();

  // The next event; nothing if none came within timeout_ms (0: only what is there). The bytes of a segment are valid
  // until the next call. Errors end it for good and come again with every further call: the first connection failed
  // or the model was refused (as of StreamClient); a server that breaks the protocol (bad_input; never retried);
  // another asset under the model's name (bad_input); network, when it was given up, with what was tried and for how
  // long; interrupted.
  Result<std::optional<ReconnectingEvent>> next_event(TimeMs timeout_ms);

  // Wait for the section, over several connections if need be; other events are kept. Valid as long as this lives.
  Result<Opened> wait_until_opened(const std::function<void(double)>& on_building = {});
  Result<Bytes> receive_head();
  Result<Bytes> receive_index();

  // As of ClientSession; also while there is no connection. Numbers of lists count up over all connections.
  Result<void> set_segment_table(std::shared_ptr<const SegmentTable> table);
  Result<std::uint32_t> set_wants(std::vector<CellRun> runs);
  Result<void> release(const std::vector<CellRun>& runs);

  // Of the first connection that opened the model. `resumed`: what was given to start() is of this asset; if not, it
  // was dropped. Precondition: opened.
  const std::optional<Opened>& model() const { return model_; }
  bool head_complete() const { return head_complete_; }
  bool index_complete() const { return index_complete_; }
  Bytes head() const { return head_; }
  Bytes index() const { return index_; }
  // Segments given out or held from the start, empty ones that follow included. Precondition: opened.
  std::uint32_t held_prefix(std::uint32_t cell) const;
  bool wants_outstanding() const { return served_epoch_ != epoch_; }
  std::uint64_t received_bytes() const;  // over all connections
  std::uint32_t connections() const { return connections_; }
  std::string name() const { return address_.text() + "/" + address_.model; }

 private:
  template <class Event>
  void report(Event event);
  enum class State { waiting, connecting, greeting, opening, streaming, over };
  ReconnectingClient(const ServerAddress& address, const ReconnectOptions& options, std::optional<HeldAsset> held);
  void attempt();
  bool step();
  void take(ClientEvent& event);
  void take_opened(const Opened& opened);
  bool release_what_was_dropped();
  bool take_segment(const event::SegmentArrived& segment);
  void lost(Error error);
  void fail_for_good(Error error);
  void progressed();
  void tell_wants();
  TimeMs next_delay_ms();
  std::optional<Have> have() const;
  std::optional<ReconnectingEvent> pop();
  template <class Done>
  Result<void> await(Done done, const std::function<void(double)>& on_building = {});

  ServerAddress address_;
  ReconnectOptions options_;
  std::mt19937_64 random_;
  State state_ = State::waiting;
  std::unique_ptr<class SessionSocket> link_;
  std::optional<Error> failure_;
  std::deque<ReconnectingEvent> events_;  // none but the last is a segment, whose bytes lie in the session
  TimeMs retry_at_ms_ = 0, attempt_until_ms_ = 0, progress_ms_ = 0;
  std::uint32_t attempts_ = 0;  // since the last progress
  std::uint32_t connections_ = 0;
  std::uint64_t earlier_bytes_ = 0;

  std::optional<Opened> model_;
  std::optional<HeldAsset> given_;  // until the model is opened
  std::vector<std::byte> head_, index_;
  bool head_complete_ = false, index_complete_ = false;
  std::vector<std::uint32_t> held_;
  std::shared_ptr<const SegmentTable> table_;
  std::optional<std::vector<CellRun>> wants_;
  std::uint32_t epoch_ = 0, served_epoch_ = 0;
  std::uint32_t session_epoch_ = 0;  // of the newest list, as the connection numbers it
};

// Every cell's prefix as runs, as few as the protocol takes: beyond that, neighbouring cells state the least of theirs.
std::vector<CellRun> state_prefixes(std::span<const std::uint32_t> prefixes);

}  // namespace fanstream
