#include "server/build/processors.h"

#include <algorithm>
#include <atomic>
#include <future>
#include <system_error>
#include <thread>
#include <vector>

#ifdef __linux__
#include <sched.h>
#endif

namespace fanstream {

unsigned usable_processors() {
#ifdef __linux__
  cpu_set_t allowed;
  if (sched_getaffinity(0, sizeof allowed, &allowed) == 0)
    return static_cast<unsigned>(std::max(1, CPU_COUNT(&allowed)));
#endif
  return std::max(1U, std::thread::hardware_concurrency());
}

unsigned threads_worth_while(std::size_t triangles) {
  constexpr std::size_t kWorthAThread = 30'000;
  return triangles < kWorthAThread ? 1 : usable_processors();
}

void run_side_by_side(unsigned threads, std::size_t count, const std::function<void(std::size_t)>& task) {
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < count; i = next++) task(i);
  };
  std::vector<std::future<void>> others;  // they end before what they refer to
  for (std::size_t t = 1; t < std::min<std::size_t>(threads, count); ++t) {
    try {
      others.push_back(std::async(std::launch::async, work));
    } catch (const std::system_error&) {
      break;  // no thread to be had: those that there are will do
    }
  }
  work();
  for (std::future<void>& other : others) other.get();
}

}  // namespace fanstream
