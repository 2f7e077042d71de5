// Many clients at once in one process, each fetching a whole model and checking it: what fanstream-load is made of.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/net/server_address.h"
#include "common/support/result.h"
#include "protocol/client_session.h"

namespace fanstream {

struct LoadOptions {
  ServerAddress address;  // with a model
  std::uint32_t clients = 100;
  unsigned threads = 0;            // 0: half the cores, at least one; the server needs the others
  std::uint32_t connecting = 512;  // at most so many clients are between connect and welcome at a time
  TimeMs timeout_ms = 60'000;      // for the whole of one client
  const std::atomic<bool>* stop = nullptr;
  ClientSessionOptions session;
  // Reads a model's head and index; by default as those of an asset.
  std::function<Result<std::shared_ptr<const SegmentTable>>(Bytes head, Bytes index)> read_table = {};
};

// Of one client. Times are since its connect() began.
struct LoadOutcome {
  std::optional<Error> error;  // absent: everything arrived, every segment once, every checksum right
  double connected_ms = 0;     // TCP and handshake
  double head_ms = 0;          // enough for a first picture
  double complete_ms = 0;
  std::uint64_t bytes = 0;  // on the wire above TCP
  std::uint64_t segments = 0;
  std::uint64_t content_hash =
      0;  // over digest, head, index and all segments; equal for equal content whatever the order
};

struct Spread {
  double min = 0, median = 0, p95 = 0, max = 0;
};

// Nearest-rank percentiles. All zero if empty.
Spread spread_of(std::vector<double> values);

struct LoadReport {
  std::uint32_t clients = 0;
  std::uint32_t complete = 0;
  std::uint32_t distinct_contents = 0;  // 1 if all that completed got the same bytes
  std::uint64_t content_hash = 0;       // LoadOutcome::content_hash of one that completed
  std::uint64_t bytes = 0;
  std::uint64_t segments = 0;
  double seconds = 0;                             // from the first connect to the last client's end
  Spread connected_ms, head_ms, complete_ms;      // of those that completed
  std::map<std::string, std::uint32_t> failures;  // message: how many clients
  std::optional<Error> first_failure;
  bool interrupted = false;
};

// Runs to the end. on_progress gets (clients ended, bytes so far) about five times a second, on the calling thread.
LoadReport run_load(const LoadOptions& options,
                    const std::function<void(std::uint32_t, std::uint64_t)>& on_progress = {});

}  // namespace fanstream
