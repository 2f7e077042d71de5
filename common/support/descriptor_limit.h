// The process's limit on open descriptors: every connection takes one.
#pragma once

#include <cstdint>

namespace fanstream {

// Raises the soft limit to the hard one and returns the limit now in force (0 where there is no such thing). Never
// fails.
std::uint64_t raise_descriptor_limit();

}  // namespace fanstream
