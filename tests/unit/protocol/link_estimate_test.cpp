#include "protocol/link_estimate.h"

#include <gtest/gtest.h>

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
  for (const TimeMs ms : {90, 50, 70}) link.round_trip(ms);
  stream(link, now_ms, 1000);
  EXPECT_NEAR(static_cast<double>(link.bytes_per_s()), 1.25e6, 2e4);
  EXPECT_NEAR(static_cast<double>(link.bandwidth_delay_bytes()), 62'500, 1'000);
  EXPECT_FALSE(link.growing());
}

TEST(LinkEstimate, TimeInWhichNothingWasAskedForDoesNotCount) {
  LinkEstimate link;
  link.round_trip(50);
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
  link.round_trip(50);
  TimeMs now_ms = 0;
  stream(link, now_ms, 1000);
  for (int i = 0; i < 300; ++i) link.add(625, now_ms += 5);
  EXPECT_NEAR(static_cast<double>(link.bytes_per_s()), 1.25e5, 5e3);
}

}  // namespace
}  // namespace fanstream
