// A network link that exists in numbers only: a rate, a delay, and a sender's queue, in virtual time. The same writes
// at the same times always arrive at the same times, to the byte.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <span>
#include <vector>

namespace fanstream {

using TimeUs = std::int64_t;  // microseconds of virtual time

struct VirtualPipeOptions {
  std::uint64_t rate_bit_s = 10'000'000;  // 1 to 10^12; of the bytes written, nothing is added for packets
  TimeUs delay_us = 25'000;               // from the leaving of a byte to its arrival, 0 to 10^9
  // What a sender hands over at most beyond what has left. Stricter than TCP_NOTSENT_LOWAT, which lets one write of any
  // size in as soon as less than that is unsent.
  std::size_t unsent_limit_bytes = 32 * 1024;
};

// One direction. Bytes leave one after another: the n-th of a run without gaps, counted from 1, has left
// ceil(n * 8,000,000 / rate) microseconds after the run began, and arrives delay_us later. Not modelled: packets and
// their headers, loss, slow start. Preconditions: options in range; no time passed in is less than one passed in
// before, none above 10^15 us. Not thread safe.
class VirtualPipe {
 public:
  static constexpr TimeUs kNever = std::numeric_limits<TimeUs>::max();

  explicit VirtualPipe(const VirtualPipeOptions& options);

  // Queues all of the bytes, whatever writable() says.
  void write(std::span<const std::byte> bytes, TimeUs now_us);
  // How many bytes may be handed over now so that no more than unsent_limit_bytes have not left.
  std::size_t writable_bytes(TimeUs now_us) const;
  std::uint64_t unsent_bytes(TimeUs now_us) const;

  // Appends what has arrived since the last call, in order; returns how many bytes.
  std::size_t deliver(TimeUs now_us, std::vector<std::byte>& out);
  // When the first byte that was not delivered arrives; kNever if there is none.
  TimeUs next_arrival_us() const;
  // When all that was written has left and has arrived.
  TimeUs last_arrival_us() const;

  std::uint64_t written_bytes() const { return written_bytes_; }
  std::uint64_t delivered_bytes() const { return delivered_bytes_; }

 private:
  // Written bytes that leave without a gap.
  struct Run {
    TimeUs start_us = 0;
    std::uint64_t first_byte = 0;  // of all bytes ever written
    std::uint64_t size_bytes = 0;
  };
  std::uint64_t left_of(const Run& run, TimeUs now_us) const;
  TimeUs end_us(const Run& run, std::uint64_t bytes) const;

  VirtualPipeOptions options_;
  std::deque<Run> runs_;  // those not delivered completely, and the last one
  std::vector<std::byte> queue_;
  std::size_t queue_begin_ = 0;
  std::uint64_t written_bytes_ = 0;
  std::uint64_t delivered_bytes_ = 0;
};

// Both directions of a connection.
struct VirtualLinkOptions {
  VirtualPipeOptions to_client;
  VirtualPipeOptions to_server;
  TimeUs round_trip_us() const { return to_client.delay_us + to_server.delay_us; }
};
// Half the round trip each way, the same rate both ways. Preconditions: 1e-6 to 1e6 Mbit/s, 0 to 1e6 ms.
VirtualLinkOptions symmetric_link(double rate_mbit_s, double round_trip_ms);

// How long a plain download of so many bytes takes over a fresh connection, from the first packet of the connect to the
// last byte: a round trip to connect, one to ask, and the bytes at the link's rate.
double download_s(const VirtualLinkOptions& link, std::uint64_t size_bytes);

}  // namespace fanstream
