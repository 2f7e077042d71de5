// The TCP listener: accepts connections and serves models of a ModelProvider on all cores.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include "common/support/result.h"
#include "protocol/server_session.h"
#include "server/net/model_provider.h"

namespace fanstream {

struct ServerOptions {
  std::string host = "0.0.0.0";         // address or name to listen on; "::" takes IPv6 and IPv4
  std::uint16_t port = kDefaultPort;    // 0: the system chooses, see StreamServer::port()
  unsigned threads = 0;                 // 0: one per core
  std::uint32_t max_sessions = 10'000;  // further clients are told 'server full'
  // Bytes the kernel may hold unsent per connection before it asks for more: it asks when it holds less than half of
  // this, and then takes ServerSessionOptions::write_batch_bytes, so it never holds more than the two together, 48 KiB.
  // What it holds is sent even if it is no longer wanted. Small keeps choices late, large saves wake-ups.
  int unsent_low_water_bytes = 32 * 1024;
  TimeMs building_poll_ms = 200;
  TimeMs drain_timeout_ms = 2'000;  // stop(): how long clients have to read the goodbye
  ServerSessionOptions session;
};

// Since the start, except sessions_open.
struct ServerMetrics {
  std::uint64_t sessions_open = 0;
  std::uint64_t sessions_total = 0;
  std::uint64_t sessions_refused = 0;  // server full, or no descriptor left
  std::uint64_t sessions_failed = 0;   // ended by an error: protocol violation, timeout, stall
  std::uint64_t sent_bytes = 0;        // everything on the wire above TCP
  std::uint64_t sent_segments = 0;
};

// Thread safety: all members may be called from any thread.
class StreamServer {
 public:
  // Listens and serves in the background from then on. Errors name the address and what to do about it.
  static Result<std::unique_ptr<StreamServer>> start(const ServerOptions& options,
                                                     std::shared_ptr<ModelProvider> models);
  ~StreamServer();  // stop()
  StreamServer(const StreamServer&) = delete;
  StreamServer& operator=(const StreamServer&) = delete;

  std::uint16_t port() const;
  ServerMetrics metrics() const;
  // Takes no more clients, tells those there are, gives them drain_timeout_ms to read it, closes. Returns when all
  // threads have ended.
  void stop();

 private:
  struct Impl;
  explicit StreamServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace fanstream
