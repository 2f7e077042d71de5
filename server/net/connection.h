// One client's TCP connection: moves bytes between its socket and its ServerSession. Private to server/net.
#pragma once

#include <asio.hpp>
#include <atomic>
#include <functional>
#include <memory>
#include <vector>

#include "protocol/server_session.h"
#include "server/net/stream_server.h"

namespace fanstream {

struct ServerCounters {
  std::atomic<std::uint64_t> sessions_open{0}, sessions_total{0}, sessions_refused{0}, sessions_failed{0},
      sent_bytes{0}, sent_segments{0};
};

// What all connections of a server share. Outlives them.
struct ServerShared {
  ServerOptions options;
  std::shared_ptr<ModelProvider> models;
  ServerCounters counters;
};

// Every member runs on the socket's strand, except start() and shut_down(), which go there by themselves.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  // on_end is called once, on the strand, when the socket is closed.
  Connection(asio::ip::tcp::socket socket, ServerShared& shared, std::function<void(Connection*)> on_end);
  void start(bool refuse_as_full);
  void shut_down();

 private:
  void configure_socket();
  void pump();
  void wait_readable();
  void wait_writable();
  void read_some();
  bool take_input();
  bool holds_little_unsent();
  void write_some();
  void answer(const ServerEvent& event);
  void answer_open(const std::string& model);
  void arm_timer();
  void on_timer();
  void linger();
  void discard_input();
  void end();

  asio::ip::tcp::socket socket_;
  asio::steady_timer timer_;
  ServerShared& shared_;
  std::function<void(Connection*)> on_end_;
  ServerSession session_;
  std::vector<asio::const_buffer> gather_;
  bool reading_ = false;
  bool writing_ = false;
  bool lingering_ = false;
  bool told_to_stop_ = false;
  bool ended_ = false;
  TimeMs linger_until_ms_ = 0;
};

}  // namespace fanstream
