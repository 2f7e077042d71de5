#include "tests/support/shaping_relay.h"

#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <deque>

namespace fanstream::testing {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::size_t kPacketBytes = 1448;

struct Packet {
  Clock::time_point leaves;   // the queue
  Clock::time_point arrives;  // at the other end
  std::vector<std::byte> bytes;
};

}  // namespace

ShapingRelay::ShapingRelay(std::uint16_t server_port, const LinkShape& shape)
    : shape_(shape), thread_([this, server_port] {
        RawSocket client = listener_.accept();
        RawSocket server = RawSocket::connect(server_port, shape_.receive_buffer_bytes);
        std::thread up([&] { carry(client, server, up_, true); });
        carry(server, client, down_, false);
        up.join();
      }) {}

ShapingRelay::~ShapingRelay() {
  stopping_ = true;
  RawSocket::connect(listener_.port()).close();  // in case that no client ever came
  thread_.join();
}

void ShapingRelay::carry(RawSocket& from, RawSocket& to, Direction& direction, bool up) {
  std::deque<Packet> packets;
  Clock::time_point link_free = Clock::now();
  bool open = true;
  while (!stopping_ && (open || !packets.empty())) {
    const Clock::time_point now = Clock::now();
    while (!packets.empty() && packets.front().arrives <= now) {
      // Counted first, so that no byte can be answered before it counts as given.
      int waiting_bytes = 0;
      if (up && ::ioctl(to.descriptor(), FIONREAD, &waiting_bytes) == 0) {
        taken_when_heard_bytes_ = down_.taken_bytes + static_cast<std::uint64_t>(waiting_bytes);
      }
      direction.given_bytes += packets.front().bytes.size();
      if (!to.send(packets.front().bytes)) return from.half_close();
      packets.pop_front();
    }
    std::size_t queued_bytes = 0;
    for (auto packet = packets.rbegin(); packet != packets.rend() && packet->leaves > now; ++packet)
      queued_bytes += packet->bytes.size();
    const bool room = open && queued_bytes + kPacketBytes <= shape_.queue_bytes;
    pollfd waiting{from.descriptor(), static_cast<short>(room ? POLLIN : 0), 0};
    if (::poll(&waiting, room ? 1 : 0, 1) <= 0 || !room) continue;
    std::array<std::byte, kPacketBytes> part;
    const ssize_t size = ::recv(from.descriptor(), part.data(), part.size(), 0);
    if (size <= 0) {
      open = false;
      continue;
    }
    direction.taken_bytes += static_cast<std::uint64_t>(size);
    link_free = std::max(link_free, now) + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(
                                               static_cast<double>(size) / shape_.bytes_per_s));
    packets.push_back(
        {link_free, link_free + std::chrono::milliseconds(shape_.delay_ms), {part.begin(), part.begin() + size}});
  }
  to.half_close();
}

}  // namespace fanstream::testing
