// How much still arrives of what is no longer wanted, over a link of 10 Mbit/s and 50 ms there and back.
#include <gtest/gtest.h>

#include <functional>

#include "client/net/stream_client.h"
#include "tests/support/built_model.h"
#include "tests/support/shaping_relay.h"

namespace fanstream {
namespace {

using testing::LinkShape;
using testing::ShapingRelay;

constexpr std::uint32_t kCells = 20'000;  // 12 MB in small segments: the list is far from served when it is replaced
constexpr std::uint32_t kJumps = 4;

struct Jump {
  std::uint64_t stale_bytes = 0;  // payload of segments of the old list that came after the new one was set
  std::uint64_t given_before_bytes = 0;
  std::uint64_t taken_when_heard_bytes = 0;
};

class StaleBytes : public ::testing::Test {
 protected:
  void SetUp() override { models.add("model", source); }

  // Wants one part of the cells after another, each long before the part before it has come.
  std::vector<Jump> jump_about(ShapingRelay& relay, const StreamClientOptions& options) {
    std::vector<Jump> jumps;
    auto client = StreamClient::connect({"127.0.0.1", relay.port(), ""}, options);
    if (!client || !client->open("model") || !client->receive_index() || !client->set_segment_table(source->table())) {
      ADD_FAILURE() << "no session";
      return jumps;
    }
    const std::uint32_t part = kCells / (kJumps + 1);
    (void)client->set_wants({{0, part, kAllSegments}});
    receive(*client, 300'000, [](std::uint32_t) { return true; });
    for (std::uint32_t jump = 1; jump <= kJumps; ++jump) {
      Jump seen;
      seen.given_before_bytes = client->session().received_bytes();
      (void)client->set_wants({{jump * part, part, kAllSegments}});
      const auto is_old = [&](std::uint32_t cell) { return cell / part < jump; };
      seen.stale_bytes = receive(*client, 150'000, [&](std::uint32_t cell) { return !is_old(cell); });
      seen.taken_when_heard_bytes = relay.taken_when_client_was_heard_bytes();
      jumps.push_back(seen);
    }
    return jumps;
  }

  // Until so many bytes have come that count, and on until nothing is there to be read. Returns how many came that do
  // not.
  std::uint64_t receive(StreamClient& client, std::uint64_t bytes, const std::function<bool(std::uint32_t)>& counts) {
    std::uint64_t counted = 0, others = 0;
    for (;;) {
      const Result<std::optional<ClientEvent>> event = client.next_event(counted < bytes ? 20'000 : 0);
      if (event && !*event && counted >= bytes) break;
      if (!event || !*event) {
        ADD_FAILURE() << (event ? "silence" : event.error().message);
        break;
      }
      const auto* arrived = std::get_if<event::SegmentArrived>(&**event);
      if (arrived == nullptr) continue;
      (counts(arrived->cell) ? counted : others) += arrived->bytes.size();
    }
    return others;
  }

  std::shared_ptr<SyntheticSource> source =
      std::make_shared<SyntheticSource>(SyntheticShape{1, kCells, 30, 80, 2000, 1000});
  testing::ModelServer models;
};

// However deep the queue of the link: nothing is sent without credit.
TEST_F(StaleBytes, AreAtMostABandwidthDelayProductAnd64KiBWithAWindowOfThatSize) {
  LinkShape link;
  link.queue_bytes = 10 * link.bandwidth_delay_bytes();
  StreamClientOptions options;
  options.session.window_bytes = static_cast<std::uint32_t>(link.bandwidth_delay_bytes() + 64 * 1024);
  ShapingRelay relay(models.port(), link);
  const std::vector<Jump> jumps = jump_about(relay, options);
  ASSERT_EQ(jumps.size(), kJumps);
  for (const Jump& jump : jumps) {
    EXPECT_LE(jump.stale_bytes, link.bandwidth_delay_bytes() + 64 * 1024);
    EXPECT_GT(jump.stale_bytes, link.bandwidth_delay_bytes() / 2) << "the link was full";
  }
}

// The client measures bandwidth and round trip, which the test's machine may disturb: hence twice the product. What the
// queue holds with a large window is ten times that.
TEST_F(StaleBytes, StayFewInALinkOfDeepQueuesWithAWindowThatAdapts) {
  LinkShape link;
  link.queue_bytes = 20 * link.bandwidth_delay_bytes();
  StreamClientOptions options;
  options.session.adaptive_window = true;
  ShapingRelay relay(models.port(), link);
  const std::vector<Jump> jumps = jump_about(relay, options);
  ASSERT_EQ(jumps.size(), kJumps);
  // From the second on: by then the bandwidth has been found.
  for (std::size_t i = 1; i < jumps.size(); ++i) {
    EXPECT_LE(jumps[i].stale_bytes, 2 * link.bandwidth_delay_bytes() + 64 * 1024);
    EXPECT_GT(jumps[i].stale_bytes, link.bandwidth_delay_bytes() / 2) << "the link was full";
  }
}

// Without a window that matters: what is on the link until the server has heard of the change, and 64 KiB that wait
// before it.
TEST_F(StaleBytes, BeyondWhatTheLinkHoldsAreAtMost64KiBWithAnyWindow) {
  LinkShape link;
  ShapingRelay relay(models.port(), link);
  StreamClientOptions options;
  options.session.window_bytes = 64U << 20;  // not even granted anew, so that the list is the last that the client says
  const std::vector<Jump> jumps = jump_about(relay, options);
  ASSERT_EQ(jumps.size(), kJumps);
  for (const Jump& jump : jumps) {
    const std::uint64_t on_link = jump.taken_when_heard_bytes - jump.given_before_bytes;
    EXPECT_LE(jump.stale_bytes, on_link + 64 * 1024);
    EXPECT_GT(jump.stale_bytes, 20'000U) << "the link was full";
  }
}

}  // namespace
}  // namespace fanstream
