// One asynchronous client of the load generator. Private to client/load.
#pragma once

#include <asio.hpp>
#include <atomic>
#include <functional>
#include <memory>

#include "client/load/load_run.h"

namespace fanstream {

// Lives on one single-threaded io_context.
class LoadClient : public std::enable_shared_from_this<LoadClient> {
 public:
  using Done = std::function<void(const LoadOutcome&)>;
  LoadClient(asio::io_context& io, const LoadOptions& options, std::atomic<std::uint64_t>& bytes_so_far,
             std::function<void()> on_connected, Done on_done);
  void start(const asio::ip::tcp::endpoint& endpoint);
  void stop(Error why);

 private:
  void pump();
  void wait_readable();
  void wait_writable();
  void arm_timer();
  bool read_some();
  void on_event(ClientEvent& event);
  void finish(std::optional<Error> error);
  void connected_or_over();
  double elapsed_ms() const;
  void hash_in(Bytes bytes, std::uint64_t seed);

  asio::ip::tcp::socket socket_;
  asio::steady_timer timer_;
  const LoadOptions& options_;
  std::atomic<std::uint64_t>& bytes_so_far_;
  std::function<void()> on_connected_;
  Done on_done_;
  ClientSession session_;
  LoadOutcome outcome_;
  TimeMs started_ms_ = 0;
  std::int64_t started_us_ = 0;
  bool reading_ = false, writing_ = false, over_ = false;
};

}  // namespace fanstream
