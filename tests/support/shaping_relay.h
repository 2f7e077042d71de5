// A slow link in front of a real server, for one client: each direction has a rate, a delay and a bounded queue, so
// that what it cannot take waits at the sender, as on a real bottleneck.
#pragma once

#include <atomic>
#include <cstdint>
#include <thread>

#include "tests/support/raw_socket.h"

namespace fanstream::testing {

struct LinkShape {
  double bytes_per_s = 10e6 / 8;
  int delay_ms = 25;                  // one way
  std::size_t queue_bytes = 32'768;   // that wait for their turn on the link, without those already on it
  int receive_buffer_bytes = 65'536;  // of the socket that reads from the server: a second queue before the link

  // What fits on the link and back.
  std::size_t bandwidth_delay_bytes() const { return static_cast<std::size_t>(bytes_per_s * 2 * delay_ms / 1000); }
};

class ShapingRelay {
 public:
  ShapingRelay(std::uint16_t server_port, const LinkShape& shape);
  ~ShapingRelay();
  ShapingRelay(const ShapingRelay&) = delete;
  ShapingRelay& operator=(const ShapingRelay&) = delete;

  std::uint16_t port() const { return listener_.port(); }
  std::uint64_t taken_from_server_bytes() const { return down_.taken_bytes; }
  std::uint64_t given_to_client_bytes() const { return down_.given_bytes; }
  // What had left the server, given on or not, when bytes of the client were last given to it.
  std::uint64_t taken_when_client_was_heard_bytes() const { return taken_when_heard_bytes_; }
  std::uint64_t given_to_server_bytes() const { return up_.given_bytes; }

 private:
  struct Direction {
    std::atomic<std::uint64_t> taken_bytes{0}, given_bytes{0};
  };
  void carry(RawSocket& from, RawSocket& to, Direction& direction, bool up);

  LinkShape shape_;
  RawListener listener_;
  Direction up_, down_;
  std::atomic<std::uint64_t> taken_when_heard_bytes_{0};
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace fanstream::testing
