#include "server/net/stop_signal.h"

#include <signal.h>

namespace fanstream {
namespace {

sigset_t stop_signals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  return set;
}

}  // namespace

void hold_stop_signals() {
  const sigset_t set = stop_signals();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  ::signal(SIGPIPE, SIG_IGN);
}

int wait_for_stop_signal(std::chrono::milliseconds status_interval, const std::function<void()>& on_status) {
  const sigset_t set = stop_signals();
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(status_interval);
  const timespec interval{seconds.count(), std::chrono::nanoseconds(status_interval - seconds).count()};
  for (;;) {
    if (const int received = ::sigtimedwait(&set, nullptr, &interval); received > 0) return received;
    if (on_status) on_status();
  }
}

}  // namespace fanstream
