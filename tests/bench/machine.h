// Where figures were measured, and how much memory measuring took.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

namespace fanstream::bench {

// "2 cores, <processor>, load 1.52, 2025-01-31", for the head of a report.
std::string describe_machine();

// Gives freed memory back and starts the process's peak afresh, where the system lets a process do so (Linux 4.0).
void reset_peak_memory();
// The peak since then, or since the process began: VmHWM of the whole process. 0 where there is no /proc.
std::uint64_t peak_memory_bytes();
// RssAnon: the memory of its own that the process has resident now: all but what it maps from files, its code above
// all. 0 where there is no /proc.
std::uint64_t own_resident_bytes();

// Keeps the thread that makes one, and the threads that it starts, on the processor where it is, until that is gone.
class OnOneProcessor {
 public:
  OnOneProcessor();
  ~OnOneProcessor();
  OnOneProcessor(const OnOneProcessor&) = delete;
  OnOneProcessor& operator=(const OnOneProcessor&) = delete;
  bool holds() const { return before_ != nullptr; }  // not where the system knows no such thing

 private:
  struct Processors;
  std::unique_ptr<Processors> before_;
};

}  // namespace fanstream::bench
