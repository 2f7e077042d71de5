// Many clients at one server, both in this process, over loopback.
#pragma once

#include <functional>
#include <memory>

#include "client/load/load_run.h"
#include "tests/bench/open_asset.h"

namespace fanstream::bench {

struct LoadMeasurement {
  LoadReport report;
  bool exact = false;  // every client completed, and what they got is the asset, byte for byte by its hash
  std::uint64_t server_sent_bytes = 0;
};

// Serves the asset on a port of the system's choice with one thread per core, and lets `clients` fetch it whole at the
// same time. Fails if the server cannot start or this process may not have so many descriptors.
Result<LoadMeasurement> measure_load(std::shared_ptr<const OpenAsset> asset, std::uint32_t clients,
                                     const std::function<void(std::uint32_t, std::uint64_t)>& on_progress = {});

}  // namespace fanstream::bench
