// The segments of a model as a view asks for them, from a server (over as many connections as it takes), a server
// with a cache on disk, or an asset file. The same calls for all three.
//
//   open(); head(); index(); use_index(); want(); next_event() ...
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "client/cache/segment_cache.h"
#include "client/model/segment_order.h"
#include "client/net/reconnecting_client.h"

namespace fanstream {

struct SegmentStreamOptions {
  SegmentStreamOptions() { network.client.session.adaptive_window = true; }  // wants change: little may be under way
  ReconnectOptions network;                      // its client.stop also ends waits for files
  std::function<void(double)> on_building = {};  // while the server builds the model: the share done, 0 to 1
  std::filesystem::path cache_folder = {};       // empty: nothing is kept on disk
  std::uint64_t cache_limit_bytes = 1ULL << 30;
};

namespace event {
// Goes on without the cache on disk from now on, and why. What is in it stays there.
struct CacheOff {
  std::string reason;
};
}  // namespace event

// Bytes of a segment are valid until the next call. WantsServed: all segments of the newest list have been given out.
using StreamEvent = std::variant<event::SegmentArrived, event::WantsServed, event::ServerDegraded,
                                 event::ConnectionLost, event::Retrying, event::ConnectionResumed, event::CacheOff>;

// Errors begin with name(). Not thread safe.
class SegmentStream {
 public:
  // The path of an existing file, or HOST:PORT/MODEL. Waits until it is open: for a server, until the model is built.
  // A cache that cannot be used is no error: CacheOff will be the first event.
  static Result<std::unique_ptr<SegmentStream>> open(const std::string& text, const SegmentStreamOptions& options);
  virtual ~SegmentStream() = default;

  virtual const std::string& name() const = 0;  // "localhost:7370/bunny" or the file's path
  virtual std::string model() const = 0;        // "bunny": on the server, or the file's name without extension
  virtual Digest digest() const = 0;            // as announced

  // Wait for the section; valid as long as the stream. The index comes after the head.
  virtual Result<std::span<const std::byte>> head() = 0;
  virtual Result<std::span<const std::byte>> index() = 0;
  // What was read of index(): to be told before want().
  virtual Result<void> use_index(const AssetIndex& index) = 0;
  // The index has come to know the children of this cell (read_page), whose page was given out: to be told before the
  // next call of anything else. Nothing is to be wanted of cells that are not known.
  virtual void learn_children(const AssetIndex& index, std::uint32_t parent) = 0;

  // An ordered list of (cell, prefix), in runs; replaces the list before it. Segments given out before and not released
  // are left out. Returns its number, which WantsServed names. Fails on cells that the model has not.
  virtual Result<std::uint32_t> want(std::vector<CellRun> runs) = 0;
  // The segments from `prefix` on of these cells were dropped, and come again if they are wanted by a list that
  // follows.
  virtual Result<void> release(const std::vector<CellRun>& runs) = 0;
  // The next event; nothing if none came within timeout_ms (0: only what is there). A file has nothing to wait for.
  // Errors end the stream, as of ReconnectingClient.
  virtual Result<std::optional<StreamEvent>> next_event(TimeMs timeout_ms) = 0;

  // Segments of the cell given out and not released, empty ones that follow included. Precondition: use_index().
  virtual std::uint32_t held_prefix(std::uint32_t cell) const = 0;
  virtual bool wants_outstanding() const = 0;
  // Everything that came over the network, or what was read of the file.
  virtual std::uint64_t received_bytes() const = 0;
  virtual std::uint64_t cached_bytes() const { return 0; }  // of segments, that came from the cache on disk
};

}  // namespace fanstream
