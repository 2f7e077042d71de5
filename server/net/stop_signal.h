// Waiting for SIGINT or SIGTERM, as a server's main does.
#pragma once

#include <chrono>
#include <functional>

namespace fanstream {

// From now on SIGINT and SIGTERM wait for wait_for_stop_signal() instead of ending the process, and a closed pipe is an
// error of the write (SIGPIPE is ignored). Call it before any thread is started, since threads inherit it.
void hold_stop_signals();

// Returns the signal's number, at once if one came since hold_stop_signals(), which must have been called. Meanwhile
// calls on_status (if there is one) every interval, on this thread.
int wait_for_stop_signal(std::chrono::milliseconds status_interval, const std::function<void()>& on_status);

}  // namespace fanstream
