#include "client/net/session_socket.h"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <thread>

#include "tests/support/raw_socket.h"

namespace fanstream {
namespace {

using asio::ip::tcp;

tcp::endpoint at(std::uint16_t port) { return {asio::ip::make_address("127.0.0.1"), port}; }

// A port that answers nothing, as behind a firewall that drops what comes: its queue of connections is full.
class BlackHole {
 public:
  BlackHole() {
    listener_ = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    ::bind(listener_, reinterpret_cast<const sockaddr*>(&address), size);
    ::listen(listener_, 0);
    ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
    for (int i = 0; i < 64 && !is_silent_; ++i) {
      const int client = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0);
      clients_.push_back(client);
      (void)::connect(client, reinterpret_cast<const sockaddr*>(&address), size);
      pollfd waits{client, POLLOUT, 0};
      is_silent_ = ::poll(&waits, 1, 100) == 0;
    }
  }
  ~BlackHole() {
    for (const int client : clients_) ::close(client);
    ::close(listener_);
  }
  bool is_silent() const { return is_silent_; }
  std::uint16_t port() const { return port_; }

 private:
  int listener_ = -1;
  std::vector<int> clients_;
  std::uint16_t port_ = 0;
  bool is_silent_ = false;
};

// As stream clients do it: until connected, failed or the time is over.
std::string outcome(SessionSocket& socket, TimeMs until_ms) {
  while (steady_now_ms() < until_ms) {
    const Result<bool> connected = socket.connected();
    if (!connected) return connected.error().message;
    if (*connected) return "connected";
    socket.wait(5);
  }
  return "no connection";
}

TEST(SessionSocket, AnAddressThatAnswersNothingLeavesTimeForThoseBehindIt) {
  const BlackHole hole;
  if (!hole.is_silent()) GTEST_SKIP() << "this system answers although nobody accepts";
  const RawListener listener;
  for (const std::size_t holes : {1U, 3U}) {
    SCOPED_TRACE(holes);
    SessionSocket socket({"host", 1, ""}, {});
    std::vector<tcp::endpoint> endpoints(holes, at(hole.port()));
    endpoints.push_back(at(listener.port()));
    const TimeMs until_ms = steady_now_ms() + 2'000;
    socket.begin_connect(std::move(endpoints), until_ms);
    EXPECT_EQ(outcome(socket, until_ms), "connected");
  }
}

TEST(SessionSocket, TheLastAddressIsWaitedForUntilTheEnd) {
  const BlackHole hole;
  if (!hole.is_silent()) GTEST_SKIP() << "this system answers although nobody accepts";
  SessionSocket socket({"host", 1, ""}, {});
  const TimeMs until_ms = steady_now_ms() + 300;
  socket.begin_connect({at(hole.port()), at(hole.port())}, until_ms);
  EXPECT_EQ(outcome(socket, until_ms), "no connection");
}

TEST(SessionSocket, AnAddressThatRefusesIsLeftAtOnceAndTheLastOnesFailureIsTheError) {
  std::uint16_t unused = 0;
  {
    const RawListener closed;
    unused = closed.port();
  }
  const RawListener listener;
  SessionSocket socket({"host", 1, ""}, {}), refused({"host", 1, ""}, {});
  const TimeMs until_ms = steady_now_ms() + 60'000;
  socket.begin_connect({at(unused), at(unused), at(listener.port())}, until_ms);
  EXPECT_EQ(outcome(socket, until_ms), "connected");
  refused.begin_connect({at(unused), at(unused)}, until_ms);
  EXPECT_NE(outcome(refused, until_ms).find("refused"), std::string::npos);
}

}  // namespace
}  // namespace fanstream
