#include "server/net/stop_signal.h"

#include <asio.hpp>
#include <csignal>

namespace fanstream {

int wait_for_stop_signal(std::chrono::milliseconds status_interval, const std::function<void()>& on_status) {
  asio::io_context io;
  asio::signal_set signals(io, SIGINT, SIGTERM);
  int received = 0;
  signals.async_wait([&](const asio::error_code& error, int signal_number) {
    if (!error) received = signal_number;
  });
  while (received == 0) {
    if (io.run_for(status_interval) == 0 && on_status) on_status();
  }
  return received;
}

}  // namespace fanstream
