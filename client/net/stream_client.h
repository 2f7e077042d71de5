// A connection to a Fanstream server, as blocking calls with timeouts. Starts no threads and has no global state;
// everything happens inside the calls, so a caller with a view to draw calls next_event() in between, at least once a
// minute: the server gives up on clients that leave its pings unanswered (90 s by default).
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/net/server_address.h"
#include "common/support/result.h"
#include "protocol/client_session.h"

namespace fanstream {

TimeMs steady_now_ms();

struct StreamClientOptions {
  // Until the server's welcome, whichever of the host's addresses it comes from; looking up a host name takes as long
  // as the system lets it.
  TimeMs connect_timeout_ms = 10'000;
  // Set to true (by a signal handler, say) to make every call return `interrupted` within 0.1 s. May be null; must
  // outlive the client.
  const std::atomic<bool>* stop = nullptr;
  ClientSessionOptions session;
};

// Every error names host:port and what happened. Errors of kind `usage`, `not_found` and a refused request leave the
// connection usable; after any other the connection is over, and what was received stays readable here. Not thread
// safe. Movable.
class StreamClient {
 public:
  static Result<StreamClient> connect(const ServerAddress& address, const StreamClientOptions& options = {});
  StreamClient(StreamClient&&) noexcept;
  StreamClient& operator=(StreamClient&&) noexcept;
  ~StreamClient();

  Result<std::vector<CatalogueEntry>> list();

  // Waits until the model is ready. While the server builds it, on_building gets the fraction done (0 to 1).
  // With `have`: see Opened::resumed. One model per connection; after an error of kind not_found another may be opened.
  Result<Opened> open(const std::string& model, const std::function<void(double)>& on_building = {},
                      std::optional<Have> have = {});
  // Wait until the head or the index is complete. Empty if `have` said that it is held.
  // The bytes live as long as the client.
  Result<Bytes> receive_head();
  Result<Bytes> receive_index();

  // See ClientSession: to be told after receive_index() and before anything else is waited for.
  Result<void> set_segment_table(std::shared_ptr<const SegmentTable> table);
  // See ClientSession. Sent with the next call that waits.
  Result<std::uint32_t> set_wants(std::vector<CellRun> runs);
  Result<void> release(const std::vector<CellRun>& runs);

  // The next SegmentArrived, WantsServed, Refused or ServerDegraded; nothing if none came within timeout_ms (0: only
  // what is there). The bytes of a segment are valid until the next call.
  Result<std::optional<ClientEvent>> next_event(TimeMs timeout_ms);

  const ClientSession& session() const;  // held prefixes, counts
  std::string server_text() const;       // "host:port"

 private:
  struct Impl;
  explicit StreamClient(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace fanstream
