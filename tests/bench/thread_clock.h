// CPU time of the calling thread: on a machine that does other work too, what a computation costs.
#pragma once

#include <ctime>

namespace fanstream::bench {

inline double thread_cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace fanstream::bench
