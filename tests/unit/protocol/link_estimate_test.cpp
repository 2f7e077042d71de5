#include "protocol/link_estimate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>

namespace fanstream {
namespace {

// Bytes as a link of 1.25 MB/s gives them, every 5 ms.
void stream(LinkEstimate& link, TimeMs& now_ms, TimeMs for_ms) {
  for (const TimeMs end_ms = now_ms + for_ms; now_ms < end_ms; now_ms += 5) link.add(6250, now_ms);
}

TEST(LinkEstimate, FindsBandwidthAndRoundTripOfASteadyLink) {
  LinkEstimate link;
  TimeMs now_ms = 1000;
  link.add(6250, now_ms);
  EXPECT_EQ(link.bandwidth_delay_bytes(), 0U) << "no round trip is known";
  for (const TimeMs ms : {90, 50, 70}) link.round_trip(ms, now_ms);
  stream(link, now_ms, 1000);
  EXPECT_NEAR(static_cast<double>(link.bytes_per_s()), 1.25e6, 2e4);
  EXPECT_NEAR(static_cast<double>(link.bandwidth_delay_bytes()), 62'500, 1'000);
  EXPECT_FALSE(link.growing());
}

TEST(LinkEstimate, TimeInWhichNothingWasAskedForDoesNotCount) {
  LinkEstimate link;
  link.round_trip(50, 0);
  TimeMs now_ms = 0;
  for (int i = 0; i < 20; ++i) {
    stream(link, now_ms, 300);
    link.pause();
    now_ms += 10'000;
  }
  EXPECT_NEAR(static_cast<double>(link.bytes_per_s()), 1.25e6, 2e4);
}

TEST(LinkEstimate, FollowsALinkThatBecomesSlower) {
  LinkEstimate link;
  link.round_trip(50, 0);
  TimeMs now_ms = 0;
  stream(link, now_ms, 1000);
  for (int i = 0; i < 300; ++i) link.add(625, now_ms += 5);
  EXPECT_NEAR(static_cast<double>(link.bytes_per_s()), 1.25e5, 5e3);
}

// A client that always wants more, whose window follows the estimate as ClientSession's does, over a link with a deep
// queue. Pings wait in that queue too.
struct Download {
  LinkEstimate link;
  TimeMs now_ms = 0;
  std::uint64_t bytes_per_s = 12'500'000;
  std::uint64_t round_trip_ms = 20;
  std::uint64_t window_bytes = 256 * 1024;
  std::uint64_t most_window_bytes = 0;
  std::deque<std::uint64_t> granted_bytes = {};  // windows on their way to the server, one a millisecond

  void ping() {
    const std::uint64_t queue_ms = window_bytes * 1000 / bytes_per_s;
    link.round_trip(static_cast<TimeMs>(std::max(round_trip_ms, queue_ms)), now_ms);
  }
  // Bytes that came in this time.
  std::uint64_t run(TimeMs for_ms) {
    std::uint64_t came_bytes = 0;
    most_window_bytes = 0;
    for (const TimeMs end_ms = now_ms + for_ms; now_ms < end_ms; ++now_ms) {
      if (now_ms % 1000 == 0) ping();
      granted_bytes.push_back(window_bytes);
      while (granted_bytes.size() > round_trip_ms) granted_bytes.pop_front();
      const std::uint64_t size_bytes = std::min(bytes_per_s / 1000, granted_bytes.front() / round_trip_ms);
      came_bytes += size_bytes;
      if (link.add(size_bytes, now_ms)) {
        const std::uint64_t wanted_bytes = link.bandwidth_delay_bytes() * (link.growing() ? 2 : 1) + 48 * 1024;
        window_bytes = std::clamp<std::uint64_t>(wanted_bytes, 96 * 1024, 4 << 20);
      }
      most_window_bytes = std::max(most_window_bytes, window_bytes);
    }
    return came_bytes;
  }
};

TEST(LinkEstimate, ALinkThatBecomesLongerIsFilledAgain) {
  Download download;
  download.run(10'000);
  EXPECT_EQ(download.link.round_trip_ms(), 20);
  download.round_trip_ms = 200;
  download.run(30'000);
  EXPECT_GT(download.run(10'000), 9 * 12'500'000U);
  EXPECT_EQ(download.link.round_trip_ms(), 200);
}

TEST(LinkEstimate, ALinkThatBecomesLongerAndThenFasterIsFilledAgain) {
  Download download;
  download.bytes_per_s = 1'250'000;
  download.run(10'000);
  download.round_trip_ms = 100;
  download.run(40'000);
  download.bytes_per_s = 12'500'000;
  download.run(40'000);
  EXPECT_GT(download.run(10'000), 9 * 12'500'000U);
}

TEST(LinkEstimate, ALinkThatBecomesShorterIsKnownByTheFirstAnswerThatMeetsNoQueue) {
  Download download;
  download.round_trip_ms = 200;
  download.run(60'000);
  download.round_trip_ms = 20;
  download.link.pause();
  download.link.round_trip(20, download.now_ms);
  download.run(1'000);
  EXPECT_EQ(download.link.round_trip_ms(), 20);
  download.run(10'000);
  EXPECT_LT(download.most_window_bytes, 12'500'000U / 50 + 64 * 1024);
}

TEST(LinkEstimate, ItsOwnQueueIsNotTakenForALongerLink) {
  for (const std::uint64_t bytes_per_s : {125'000, 1'250'000, 5'000'000}) {
    Download download;
    download.bytes_per_s = bytes_per_s;
    download.ping();
    download.link.round_trip(20, 0);
    download.run(5'000);
    int large = 0;
    for (int i = 0; i < 3'000; ++i) {
      download.run(100);
      const std::uint64_t usual_bytes = std::max<std::uint64_t>(96 * 1024, bytes_per_s / 50 + 64 * 1024);
      large += download.window_bytes > usual_bytes ? 1 : 0;
      ASSERT_LE(download.most_window_bytes, 2 * usual_bytes + 64 * 1024) << bytes_per_s;
    }
    EXPECT_LT(large, 300) << bytes_per_s << ": trials are to be rare";
  }
}

TEST(LinkEstimate, ALinkThatBecomesSlowerIsNotTakenForALongerOne) {
  Download download;
  download.run(10'000);
  download.bytes_per_s = 125'000;
  download.run(300'000);
  EXPECT_EQ(download.window_bytes, 96U * 1024);
  EXPECT_EQ(download.link.round_trip_ms(), 20);
}

}  // namespace
}  // namespace fanstream
