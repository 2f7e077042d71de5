// Where a session's bytes come from and whose clock it follows: a real stream, or a simulated connection in virtual
// time.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "client/model/segment_stream.h"
#include "client/session/view_session.h"
#include "common/asset/asset_layout.h"
#include "protocol/runs.h"

namespace fanstream {

namespace event {
struct HeadArrived {
  std::span<const std::byte> bytes;
};
struct IndexArrived {
  std::span<const std::byte> bytes;
};
struct PieceArrived {
  std::uint32_t cell = 0;
  std::uint32_t segment = 0;
  std::span<const std::byte> bytes;
};
struct ListServed {};
// The session goes on without, for now and for this reason; empty: all is well again.
struct Hindered {
  std::string reason;
};
}  // namespace event

// What a server's notice means for the session: one that all is well again (DegradedReason::none) hinders nothing.
inline event::Hindered hindrance_of(const event::ServerDegraded& notice) {
  return {notice.reason == DegradedReason::none ? std::string() : notice.text};
}

using TransportEvent =
    std::variant<event::HeadArrived, event::IndexArrived, event::PieceArrived, event::ListServed, event::Hindered>;

// Not thread safe. Times are seconds since the session began, before the connection is made.
class SessionTransport {
 public:
  using OnEvent = std::function<Result<void>(const TransportEvent&, double now_s)>;
  virtual ~SessionTransport() = default;

  // Goes on to a time that does not go back, calling on_event for what comes until then; it may call want and release.
  // Head first, then the index, then what is wanted. An error of on_event ends it and is returned.
  virtual Result<void> run_until(double time_s, const OnEvent& on_event) = 0;
  // What was read of the index, before the first want.
  virtual Result<void> use_index(const AssetIndex& index) = 0;
  // What a page tells of, while on_event handles it.
  virtual void learn_children(const AssetIndex& index, std::uint32_t parent) = 0;
  virtual Result<void> want(std::vector<CellRun> runs) = 0;
  virtual Result<void> release(const std::vector<CellRun>& runs) = 0;
  virtual double now_s() const = 0;
  virtual std::uint64_t received_bytes() const = 0;
  virtual const std::string& name() const = 0;
};

// Over a link that exists in numbers only; `asset` is what its server has.
std::unique_ptr<SessionTransport> simulated_transport(std::shared_ptr<const SegmentSource> asset,
                                                      const VirtualLinkOptions& link, std::string name);
// The source itself, its model built; told of the settings' stop and progress. Without a folder there is no cache.
Result<std::unique_ptr<SegmentStream>> open_stream(const SessionSettings& settings,
                                                   const std::filesystem::path& cache_folder = {});
// From a server or a file, by the clock.
Result<std::unique_ptr<SessionTransport>> streamed_transport(const SessionSettings& settings);

}  // namespace fanstream
