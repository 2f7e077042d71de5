// Waiting for SIGINT or SIGTERM, as a server's main does.
#pragma once

#include <chrono>
#include <functional>

namespace fanstream {

// Returns the signal's number. Meanwhile calls on_status (if there is one) every interval, on this thread. The signals
// must not be handled elsewhere in the process.
int wait_for_stop_signal(std::chrono::milliseconds status_interval, const std::function<void()>& on_status);

}  // namespace fanstream
