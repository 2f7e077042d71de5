#include "client/session/virtual_link.h"

#include <gtest/gtest.h>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::SeededRandom;

std::vector<std::byte> numbered(std::size_t size, std::size_t first = 0) {
  std::vector<std::byte> bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>((first + i) * 37 >> 3U);
  return bytes;
}

// When byte `n`, counted from 1, of a write at 0 is there.
TimeUs formula(std::uint64_t n, std::uint64_t rate_bit_s, TimeUs delay_us) {
  return static_cast<TimeUs>((n * 8'000'000 + rate_bit_s - 1) / rate_bit_s) + delay_us;
}

TEST(VirtualPipe, EveryByteArrivesAtSizeByRatePlusDelay) {
  for (const std::uint64_t rate_bit_s : {1'000ULL, 56'000ULL, 10'000'000ULL, 999'999'937ULL}) {
    for (const TimeUs delay_us : {TimeUs{0}, TimeUs{25'000}}) {
      VirtualPipe pipe({rate_bit_s, delay_us, 1000});
      pipe.write(numbered(3000), 0);
      std::vector<std::byte> out;
      for (std::uint64_t n = 1; n <= 3000; ++n) {
        const TimeUs due_us = formula(n, rate_bit_s, delay_us);
        if (out.size() >= n) continue;  // several bytes a microsecond
        ASSERT_EQ(pipe.next_arrival_us(), due_us) << "byte " << n << " at " << rate_bit_s << " bit/s";
        if (due_us > 0) pipe.deliver(due_us - 1, out);
        ASSERT_LT(out.size(), n);
        pipe.deliver(due_us, out);
        ASSERT_GE(out.size(), n);
      }
      EXPECT_EQ(out, numbered(3000));
      EXPECT_EQ(pipe.last_arrival_us(), formula(3000, rate_bit_s, delay_us));
      EXPECT_EQ(pipe.next_arrival_us(), VirtualPipe::kNever);
    }
  }
}

TEST(VirtualPipe, WritesQueueBehindEachOtherAndAnIdleLinkStartsAnew) {
  VirtualPipe pipe({8'000'000, 100, 1000});  // a byte a microsecond
  std::vector<std::byte> out;
  pipe.write(numbered(50), 0);
  pipe.write(numbered(50, 50), 10);  // waits until 50
  EXPECT_EQ(pipe.last_arrival_us(), 200);
  pipe.write(numbered(10, 100), 500);
  EXPECT_EQ(pipe.last_arrival_us(), 610);
  EXPECT_EQ(pipe.deliver(150, out), 50U);
  EXPECT_EQ(pipe.deliver(601, out), 51U);
  EXPECT_EQ(pipe.next_arrival_us(), 602);
  EXPECT_EQ(pipe.deliver(1000, out), 9U);
  EXPECT_EQ(out, numbered(110));
}

TEST(VirtualPipe, TellsHowMuchMayBeHandedOver) {
  VirtualPipe pipe({8'000'000, 1'000'000, 1000});
  EXPECT_EQ(pipe.writable_bytes(0), 1000U);
  pipe.write(numbered(600), 0);
  EXPECT_EQ(pipe.writable_bytes(0), 400U);
  EXPECT_EQ(pipe.writable_bytes(100), 500U);  // what has left and not arrived is not the sender's any more
  pipe.write(numbered(900), 100);
  EXPECT_EQ(pipe.writable_bytes(100), 0U);
  EXPECT_EQ(pipe.unsent_bytes(100), 1400U);
  EXPECT_EQ(pipe.writable_bytes(500), 0U);
  EXPECT_EQ(pipe.writable_bytes(501), 1U);
  EXPECT_EQ(pipe.writable_bytes(5000), 1000U);
}

// A sender that always fills its room keeps the link busy: the last byte arrives as if all had been written at once.
TEST(VirtualPipe, ASenderWithinItsRoomLosesNoTime) {
  const std::uint64_t seed = 11;
  SeededRandom random(seed);
  for (int round = 0; round < 50; ++round) {
    const VirtualPipeOptions options{1'000'000 + random.below(50'000'000), static_cast<TimeUs>(random.below(50'000)),
                                     20'000};
    VirtualPipe pipe(options);
    const std::size_t total = 100'000 + random.below(100'000);
    const std::vector<std::byte> bytes = numbered(total);
    std::vector<std::byte> out;
    TimeUs now_us = 0;
    for (std::size_t written = 0; written < total; now_us += random.below(1500)) {
      const std::size_t count = std::min(pipe.writable_bytes(now_us), total - written);
      pipe.write(std::span(bytes).subspan(written, count), now_us);
      written += count;
      ASSERT_LE(pipe.unsent_bytes(now_us), options.unsent_limit_bytes);
      if (random.one_in(3)) pipe.deliver(now_us, out);
    }
    EXPECT_EQ(pipe.last_arrival_us(), formula(total, options.rate_bit_s, options.delay_us)) << "seed " << seed;
    pipe.deliver(pipe.last_arrival_us(), out);
    EXPECT_EQ(out, bytes) << "seed " << seed << ", round " << round;
  }
}

TEST(VirtualLink, SplitsTheRoundTripAndAddsItToDownloads) {
  const VirtualLinkOptions link = symmetric_link(10.0, 50.001);
  EXPECT_EQ(link.to_client.rate_bit_s, 10'000'000U);
  EXPECT_EQ(link.round_trip_us(), 50'001);
  EXPECT_EQ(link.to_client.delay_us, 25'000);
  EXPECT_NEAR(download_s(symmetric_link(10.0, 50.0), 1'250'000), 1.1, 1e-12);
}

}  // namespace
}  // namespace fanstream
