#include "tests/bench/machine.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <malloc.h>

#ifdef __linux__
#include <sched.h>
#endif

#include <ctime>
#include <fstream>
#include <thread>

namespace fanstream::bench {

namespace {

// The rest of the first line of `path` that starts with `key`, without blanks and colons before it.
std::string value_of(const char* path, const std::string& key) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.compare(0, key.size(), key) != 0) continue;
    const std::size_t start = line.find_first_not_of(" \t:", key.size());
    return start == std::string::npos ? std::string() : line.substr(start);
  }
  return {};
}

}  // namespace

std::string describe_machine() {
  const std::string processor = value_of("/proc/cpuinfo", "model name");
  const std::string load = value_of("/proc/loadavg", "");
  return fmt::format("{} cores, {}, load {}, {:%Y-%m-%d}", std::thread::hardware_concurrency(),
                     processor.empty() ? "unknown processor" : processor, load.substr(0, load.find(' ')),
                     fmt::gmtime(std::time(nullptr)));
}

void reset_peak_memory() {
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";
}

std::uint64_t own_resident_bytes() {
  const std::string kilobytes = value_of("/proc/self/status", "RssAnon:");
  return kilobytes.empty() ? 0 : 1024 * std::strtoull(kilobytes.c_str(), nullptr, 10);
}

std::uint64_t peak_memory_bytes() {
  const std::string kilobytes = value_of("/proc/self/status", "VmHWM:");
  return kilobytes.empty() ? 0 : 1024 * std::strtoull(kilobytes.c_str(), nullptr, 10);
}

#ifdef __linux__

struct OnOneProcessor::Processors {
  cpu_set_t set;
};

OnOneProcessor::OnOneProcessor() : before_(std::make_unique<Processors>()) {
  cpu_set_t one;
  CPU_ZERO(&one);
  const int here = sched_getcpu();
  if (here >= 0) CPU_SET(static_cast<unsigned>(here), &one);
  if (here < 0 || sched_getaffinity(0, sizeof before_->set, &before_->set) != 0 ||
      sched_setaffinity(0, sizeof one, &one) != 0)
    before_.reset();
}

OnOneProcessor::~OnOneProcessor() {
  if (before_ != nullptr) sched_setaffinity(0, sizeof before_->set, &before_->set);
}

#else

struct OnOneProcessor::Processors {};
OnOneProcessor::OnOneProcessor() = default;
OnOneProcessor::~OnOneProcessor() = default;

#endif

}  // namespace fanstream::bench
