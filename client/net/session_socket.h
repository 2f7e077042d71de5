// One TCP connection and the session over it, moved along without blocking. Private to client/net.
#pragma once

#include <asio.hpp>
#include <optional>
#include <vector>

#include "client/net/stream_client.h"
#include "protocol/client_session.h"

namespace fanstream {

// Errors name host:port. Not thread safe.
class SessionSocket {
 public:
  SessionSocket(const ServerAddress& address, const ClientSessionOptions& options);
  SessionSocket(const SessionSocket&) = delete;
  SessionSocket& operator=(const SessionSocket&) = delete;

  // Looks the host up, which takes as long as the system lets it, and begins to connect to its first address. With
  // until_ms (of steady_now_ms), when whoever calls wants the server's greeting, no address but the last is waited for
  // so long that none is left for those behind it: some firewalls answer nothing at all.
  Result<void> begin_connect(TimeMs until_ms);
  // The same for addresses at hand. Precondition: at least one.
  void begin_connect(std::vector<asio::ip::tcp::endpoint> endpoints, TimeMs until_ms);
  // False while it is under way. Tries the addresses one after another; the last one's failure is the error.
  Result<bool> connected();
  // Writes and reads without waiting. True if there may be events. Precondition: connected.
  bool move_bytes();
  // Until bytes come, can go, or the connection is made, at most so long.
  void wait(TimeMs most_ms);
  void close();
  bool ended() const { return read_ended_; }

  ClientSession& session() { return session_; }
  const ClientSession& session() const { return session_; }
  const ServerAddress& address() const { return address_; }
  Error located(Error error) const { return with_context(std::move(error), address_.text()); }

 private:
  void try_endpoint();

  ServerAddress address_;
  asio::io_context io_;
  asio::ip::tcp::socket socket_;
  ClientSession session_;
  std::vector<asio::ip::tcp::endpoint> endpoints_;
  std::size_t endpoint_ = 0;
  TimeMs until_ms_ = 0, endpoint_until_ms_ = 0;
  std::optional<asio::error_code> outcome_;  // of connecting to endpoint_
  bool is_connected_ = false;
  bool waiting_readable_ = false;
  bool waiting_writable_ = false;
  bool write_broken_ = false;
  bool read_ended_ = false;
};

}  // namespace fanstream
