// Memory that is going to be needed.
#pragma once

#include <cstddef>

namespace fanstream {

// Asks for the cache line at an address, whether there is memory or not, and does not wait for it. Does nothing where
// compilers have no word for it.
inline void fetch_line([[maybe_unused]] const void* at) {
#if defined(__GNUC__)
  __builtin_prefetch(at);
  __asm__ volatile("");  // GCC drops calls of functions that do nothing else
#endif
}
// For all lines of so many bytes.
inline void fetch_lines(const void* begin, std::size_t size_bytes) {
  constexpr std::size_t kLine = 64;
  const auto* const first = static_cast<const std::byte*>(begin);
  for (std::size_t at = 0; at < size_bytes; at += kLine) fetch_line(first + at);
}

}  // namespace fanstream
