// How many processors there are for us, and work for all of them.
#pragma once

#include <cstddef>
#include <functional>

namespace fanstream {

// Those that this process may run on, which may be fewer than the machine has; at least 1.
unsigned usable_processors();

// As many, where the work that a model of so many triangles makes is worth a thread; else 1.
unsigned threads_worth_while(std::size_t triangles);

// Calls task(0), ..., task(count - 1), each once, on up to `threads` threads, of which the caller's is one; returns
// when all have returned. Tasks must not depend on each other. What one throws is thrown here, after all have ended.
void run_side_by_side(unsigned threads, std::size_t count, const std::function<void(std::size_t)>& task);

}  // namespace fanstream
