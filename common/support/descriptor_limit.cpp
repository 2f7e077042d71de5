#include "common/support/descriptor_limit.h"

#ifndef __wasm__
#include <sys/resource.h>
#endif

namespace fanstream {

std::uint64_t raise_descriptor_limit() {
#ifdef __wasm__
  return 0;
#else
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return 0;
  const rlimit raised{limit.rlim_max, limit.rlim_max};
  if (setrlimit(RLIMIT_NOFILE, &raised) == 0) return raised.rlim_cur;
  return limit.rlim_cur;
#endif
}

}  // namespace fanstream
