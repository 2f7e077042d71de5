// What `serve` says while it runs: events as lines on standard output (or JSON, one object a line), and on a terminal
// one line of status that is redrawn.
#pragma once

#include <chrono>
#include <mutex>
#include <string>

#include "server/commands/output.h"
#include "server/net/stream_server.h"
#include "server/store/model_store.h"

namespace fanstream {

// The first line tells the address: events of the store wait for it. Thread safe.
class ServeLog {
 public:
  explicit ServeLog(bool json);
  void listening(const std::string& host, std::uint16_t port, std::size_t models, const std::string& store);
  void store_event(const StoreEvent& event);
  void status(const ServerMetrics& metrics);
  void stopped(const ServerMetrics& metrics);

 private:
  using Clock = std::chrono::steady_clock;
  void line(const std::string& text, const Json& json);
  void show(const StoreEvent& event);
  void clear_status();
  std::string status_text(const ServerMetrics& metrics) const;

  std::mutex mutex_;
  const bool json_;
  const bool on_terminal_;
  bool listening_ = false;
  std::vector<StoreEvent> held_;  // until listening
  bool status_drawn_ = false;
  std::string building_;  // on a terminal: "bunny 40 %"
  Clock::time_point next_progress_{};
  Clock::time_point next_status_{};
  ServerMetrics last_status_;
};

}  // namespace fanstream
