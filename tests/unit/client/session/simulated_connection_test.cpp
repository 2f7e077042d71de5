#include "client/session/simulated_connection.h"

#include <gtest/gtest.h>

#include <tuple>

#include "tests/support/synthetic_source.h"

namespace fanstream {
namespace {

SyntheticShape large_shape() {
  SyntheticShape shape;
  shape.cells = 400;
  shape.max_segments = 6;
  shape.max_segment_bytes = 4000;
  return shape;
}

SimulatedConnectionOptions over(double rate_mbit_s, double round_trip_ms) {
  SimulatedConnectionOptions options;
  options.link = symmetric_link(rate_mbit_s, round_trip_ms);
  return options;
}

const std::vector<CellRun> kAll{{0, 400, kAllSegments}};

// Asks for everything as soon as it can; returns what came and when.
using Log = std::vector<std::tuple<TimeUs, std::uint32_t, std::uint32_t>>;
Log play(SimulatedConnection& connection, const SyntheticSource& source, ReceivedModel& model, TimeUs until_us,
         TimeUs step_us) {
  Log log;
  connection.open("model");
  for (TimeUs at_us = 0; at_us <= until_us; at_us += step_us) {
    const Result<void> ran = connection.run_until(at_us, [&](const ClientEvent& event, TimeUs now_us) {
      if (std::holds_alternative<event::ModelOpened>(event)) {
        EXPECT_TRUE(connection.set_segment_table(source.table()));
        EXPECT_TRUE(connection.set_wants(kAll));
      }
      if (const auto* segment = std::get_if<event::SegmentArrived>(&event)) {
        EXPECT_TRUE(model.add(segment->cell, segment->segment, segment->bytes));
        log.emplace_back(now_us, segment->cell, segment->segment);
      }
    });
    EXPECT_TRUE(ran) << ran.error().message;
  }
  return log;
}

TEST(SimulatedConnection, BringsTheWholeAssetAsFastAsTheLinkAllows) {
  const auto source = std::make_shared<SyntheticSource>(large_shape());
  SimulatedConnection connection(source, over(10.0, 50.0));
  ReceivedModel model(*source);
  const Log log = play(connection, *source, model, 10'000'000, 40'000);
  ASSERT_TRUE(model.complete());
  EXPECT_EQ(connection.stale_bytes(), 0U);
  // A round trip each for the connection and for hello and open together; then the bytes at the link's rate without a
  // pause, but for the one in which the client's wants come back.
  const double bytes_us = 8.0 * static_cast<double>(connection.received_bytes()) / 10.0;
  const auto last_us = static_cast<double>(std::get<0>(log.back()));
  EXPECT_GE(last_us, bytes_us + 100'000.0 - 1.0);
  EXPECT_LE(last_us, bytes_us + 150'000.0 + 3'000.0);
}

TEST(SimulatedConnection, IsTheSameEveryTime) {
  const auto source = std::make_shared<SyntheticSource>(large_shape());
  Log logs[2];
  for (Log& log : logs) {
    SimulatedConnection connection(source, over(25.0, 31.7));
    ReceivedModel model(*source);
    log = play(connection, *source, model, 3'000'000, 40'000);
  }
  EXPECT_FALSE(logs[0].empty());
  EXPECT_EQ(logs[0], logs[1]);
}

TEST(SimulatedConnection, FastLinksAreNotStarvedByTheStep) {
  const auto source = std::make_shared<SyntheticSource>(large_shape());
  SimulatedConnection connection(source, over(1000.0, 2.0));
  ReceivedModel model(*source);
  const Log log = play(connection, *source, model, 1'000'000, 10'000);
  ASSERT_TRUE(model.complete());
  const double bytes_us = 8.0 * static_cast<double>(connection.received_bytes()) / 1000.0;
  EXPECT_LE(static_cast<double>(std::get<0>(log.back())), 1.3 * bytes_us + 10'000.0);
}

// A camera jump: what was asked for is of no use from one moment to the next.
TEST(SimulatedConnection, AChangeOfMindCostsWhatIsUnderWay) {
  const auto source = std::make_shared<SyntheticSource>(large_shape());
  SimulatedConnection connection(source, over(10.0, 50.0));
  connection.open("model");
  const std::vector<CellRun> first{{0, 200, kAllSegments}};
  const std::vector<CellRun> second{{200, 200, kAllSegments}};
  std::uint64_t useful_bytes = 0;
  const auto on_event = [&](const ClientEvent& event, TimeUs now_us) {
    if (std::holds_alternative<event::ModelOpened>(event)) {
      EXPECT_TRUE(connection.set_segment_table(source->table()));
      EXPECT_TRUE(connection.set_wants(first));
    }
    const auto* segment = std::get_if<event::SegmentArrived>(&event);
    if (segment != nullptr && segment->cell >= 200) {
      EXPECT_GE(now_us, 400'000 + 50'000);
      useful_bytes += segment->bytes.size();
    }
  };
  ASSERT_TRUE(connection.run_until(400'000, on_event));
  EXPECT_EQ(connection.stale_bytes(), 0U);
  ASSERT_TRUE(connection.set_wants(second));
  ASSERT_TRUE(connection.run_until(2'000'000, on_event));
  EXPECT_GT(useful_bytes, 0U);
  // 10 Mbit/s x 50 ms, what the sender may have queued, and the frame it had begun.
  EXPECT_GT(connection.stale_bytes(), 62'500U / 2);
  EXPECT_LE(connection.stale_bytes(), 62'500U + 64 * 1024);
}

TEST(SimulatedConnection, WantsBeforeTheModelIsOpenAreAnError) {
  SimulatedConnection connection(std::make_shared<SyntheticSource>(large_shape()), over(10.0, 50.0));
  EXPECT_EQ(connection.set_wants(kAll).error().kind, ErrorKind::usage);
  connection.open("");
  const Result<void> ran = connection.run_until(1'000'000, {});
  ASSERT_FALSE(ran);
  EXPECT_EQ(connection.now_us(), 1'000'000);
  EXPECT_FALSE(connection.set_wants(kAll));
}

TEST(SimulatedConnection, LongSilenceIsNoFailure) {
  SimulatedConnection connection(std::make_shared<SyntheticSource>(large_shape()), over(10.0, 50.0));
  connection.open("model");
  const Result<void> ran = connection.run_until(600'000'000, {});  // pings keep it alive
  EXPECT_TRUE(ran) << ran.error().message;
  EXPECT_TRUE(connection.client().head_complete());
}

TEST(SimulatedConnection, WhatTheServerRefusesToGoOnWithIsReported) {
  SimulatedConnectionOptions options = over(10.0, 50.0);
  options.server.handshake_timeout_ms = 10;  // less than a round trip
  SimulatedConnection connection(std::make_shared<SyntheticSource>(large_shape()), options);
  connection.open("model");
  bool told = false;
  const Result<void> ran = connection.run_until(1'000'000, [&told](const ClientEvent& event, TimeUs) {
    told = told || std::holds_alternative<event::Failed>(event);
  });
  EXPECT_FALSE(ran);
  EXPECT_TRUE(told);
}

}  // namespace
}  // namespace fanstream
