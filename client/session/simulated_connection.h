// A whole connection inside one process and in virtual time: a server session over an asset at hand, a virtual link,
// and a client session. The code of both ends is the one that runs over TCP; only the transport and the clock are made
// up, so a session over any link can be played exactly the same again.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/session/virtual_link.h"
#include "protocol/client_session.h"
#include "protocol/server_session.h"

namespace fanstream {

struct SimulatedConnectionOptions {
  VirtualLinkOptions link;
  ServerSessionOptions server;
  ClientSessionOptions client;
  // While bytes flow both ends look at the link this often; what comes in between is seen at the end of the step. 1 or
  // more.
  TimeUs step_us = 500;
};

// Time starts at 0 with the client's first packet of the TCP handshake; its first bytes leave one round trip later.
//
//   connection.open("bunny");
//   while (...) {
//     connection.run_until(time_us, [&](const ClientEvent& event, TimeUs now_us) { ... connection.set_wants(...) ...
//     });
//   }
//
// Not thread safe; distinct objects are independent.
class SimulatedConnection {
 public:
  using OnEvent = std::function<void(const ClientEvent&, TimeUs now_us)>;

  // The server offers the asset under every name. Precondition: source is not null.
  SimulatedConnection(std::shared_ptr<const SegmentSource> source, const SimulatedConnectionOptions& options);
  SimulatedConnection(const SimulatedConnection&) = delete;
  SimulatedConnection& operator=(const SimulatedConnection&) = delete;

  // Sent along with the greeting. Call once. Fails as ClientSession::open, then from run_until.
  void open(std::string model, std::optional<Have> have = {});
  // As in ClientSession, at now_us(). Also between calls of run_until.
  Result<void> set_segment_table(std::shared_ptr<const SegmentTable> table) {
    return client_.set_segment_table(std::move(table));
  }
  Result<std::uint32_t> set_wants(std::vector<CellRun> runs);
  Result<void> release(const std::vector<CellRun>& runs);

  // Goes on to `until_us`, which is not before now_us(), calling on_event for each event of the client when it comes
  // (within step_us). The handler may call everything here but run_until. Fails with the error of event::Failed, which
  // the handler sees too; nothing happens afterwards but that time passes.
  Result<void> run_until(TimeUs until_us, const OnEvent& on_event);

  const ClientSession& client() const { return client_; }
  const ServerSession& server() const { return server_; }
  TimeUs now_us() const { return now_us_; }

  // Everything that has come to the client, whatever it was.
  std::uint64_t received_bytes() const { return to_client_.delivered_bytes(); }
  // Bytes of segments that arrived though the newest list at that moment did not ask for them: what a change of mind
  // costs.
  std::uint64_t stale_bytes() const { return stale_bytes_; }

 private:
  TimeUs next_time_us(TimeUs until_us) const;
  void step(const OnEvent& on_event);
  void serve();
  void send_from_server();
  void take_client_events(const OnEvent& on_event);
  bool is_wanted(std::uint32_t cell, std::uint32_t segment) const;
  TimeMs now_ms() const { return now_us_ / 1000; }

  SimulatedConnectionOptions options_;
  std::shared_ptr<const SegmentSource> source_;
  VirtualPipe to_client_;
  VirtualPipe to_server_;
  ServerSession server_;
  ClientSession client_;
  TimeUs now_us_ = 0;
  TimeUs connected_us_;
  TimeUs busy_step_us_;
  std::optional<Error> failure_;
  std::vector<std::uint32_t> wanted_prefix_;  // by cell, of the newest list
  std::vector<std::byte> scratch_, arrived_;
  std::uint64_t stale_bytes_ = 0;
};

}  // namespace fanstream
