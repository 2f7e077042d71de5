// One asynchronous client of the load generator. Private to client/load.
#pragma once

#include <asio.hpp>
#include <atomic>
#include <functional>
#include <map>
#include <memory>

#include "client/load/load_run.h"
#include "common/asset/asset_layout.h"

namespace fanstream {

// What is known of an asset's segments. It is the table alone where somebody else has read it.
struct LoadTable {
  std::shared_ptr<const SegmentTable> segments;
  std::shared_ptr<const AssetHead> head;
  std::shared_ptr<AssetIndex> index;
  std::shared_ptr<SegmentTable> growing;  // the same as `segments`

  // Reads a page, if this is one that is not known yet.
  Result<void> learn(std::uint32_t cell, std::uint32_t segment, Bytes bytes) const;
};

// Those of what the clients of one thread receive: all get the same index and pages, and they are read once.
class LoadTables {
 public:
  explicit LoadTables(const LoadOptions& options) : options_(options) {}
  Result<LoadTable> find(Bytes head, Bytes index);

 private:
  const LoadOptions& options_;
  std::map<std::uint64_t, LoadTable> tables_;  // by a hash of head and index
};

// Lives on one single-threaded io_context.
class LoadClient : public std::enable_shared_from_this<LoadClient> {
 public:
  using Done = std::function<void(const LoadOutcome&)>;
  LoadClient(asio::io_context& io, const LoadOptions& options, LoadTables& tables,
             std::atomic<std::uint64_t>& bytes_so_far, std::function<void()> on_connected, Done on_done);
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
  LoadTables& tables_;
  std::atomic<std::uint64_t>& bytes_so_far_;
  std::function<void()> on_connected_;
  Done on_done_;
  ClientSession session_;
  LoadOutcome outcome_;
  LoadTable table_;
  TimeMs started_ms_ = 0;
  std::int64_t started_us_ = 0;
  bool reading_ = false, writing_ = false, over_ = false;
};

}  // namespace fanstream
