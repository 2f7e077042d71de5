// Memory that has been freed, back to the system.
#pragma once

namespace fanstream {

// Gives back the pages that the C library's allocator holds and nobody uses: after work that took much for a short
// time. Takes time for what the process has. Does nothing where the library has no way to (others than glibc).
void give_back_free_memory();

}  // namespace fanstream
