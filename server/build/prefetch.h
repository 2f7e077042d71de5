// Asking for memory before it is needed.
#pragma once

namespace fanstream {

// A merge touches vertices from all over the model: waiting for them one after the other would take most of the time.
inline void prefetch(const void* address) { __builtin_prefetch(address); }

}  // namespace fanstream
