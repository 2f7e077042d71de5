// How many processors there are for us.
#pragma once

namespace fanstream {

// Those that this process may run on, which may be fewer than the machine has; at least 1.
unsigned usable_processors();

}  // namespace fanstream
