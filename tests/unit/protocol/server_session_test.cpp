// What a server session does to clients that ask for much, take little, or neither.
#include "protocol/server_session.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

#include "tests/unit/protocol/session_pair.h"

namespace fanstream {
namespace {

constexpr std::size_t kMaxUnsentBytes = 256 * 1024;  // PROTOCOL.md, section 7
constexpr std::size_t kEntriesPerTurn = 64 * 1024;

// A server session alone, with a client that the test plays byte by byte.
struct Server {
  explicit Server(std::shared_ptr<const SegmentSource> model = {}) : source(std::move(model)) {
    std::vector<std::byte> hello;
    encode(Hello{}, hello);
    say(hello);
  }

  template <class... Arguments>
  void say_message(const Arguments&... arguments) {
    std::vector<std::byte> frame;
    encode(arguments..., frame);
    say(frame);
  }
  void say_list(int times = 1) {
    std::vector<std::byte> frames;
    for (int i = 0; i < times; ++i) write_frame(FrameType::list, {}, frames);
    say(frames);
  }
  void say(Bytes bytes) {
    session.receive(bytes, now_ms);
    serve();
  }

  void serve() {
    while (const std::optional<ServerEvent> event = session.next_event(now_ms)) {
      if (std::holds_alternative<ListRequested>(*event)) {
        ++lists;
        session.send_catalogue(catalogue);
      } else {
        session.open_ready(source);
      }
    }
  }

  // The transport takes at most this many bytes of one write; returns how many there were to take.
  std::size_t write(std::size_t max_bytes = ~std::size_t{0}) {
    std::array<Bytes, 64> buffers;
    const std::size_t count = session.next_write(buffers, scratch);
    std::size_t offered = 0, taken = 0;
    for (const Bytes& buffer : std::span(buffers).first(count)) {
      offered += buffer.size();
      const Bytes part = buffer.first(std::min(buffer.size(), max_bytes - taken));
      reader.push(part);
      taken += part.size();
    }
    session.written(taken, now_ms);
    serve();
    return offered;
  }
  void write_all() {
    while (session.wants_to_send()) write();
  }

  // Frames that have come whole, by type.
  std::map<FrameType, int> frames() {
    std::map<FrameType, int> count;
    for (auto frame = reader.next(); frame && *frame; frame = reader.next()) ++count[(*frame)->type];
    return count;
  }

  void pass(TimeMs ms) {
    now_ms += ms;
    session.tick(now_ms);
  }

  std::shared_ptr<const SegmentSource> source;
  std::vector<CatalogueEntry> catalogue = {{"m", ModelState::failed, 0, "broken"}};
  TimeMs now_ms = 0;
  int lists = 0;
  std::vector<std::byte> scratch;
  FrameReader reader{Receiver::client};
  ServerSession session{{}, 0};
};

// Several megabytes.
std::vector<CatalogueEntry> largest_catalogue() {
  std::vector<CatalogueEntry> entries(kMaxCatalogueEntries);
  for (std::size_t i = 0; i < entries.size(); ++i) entries[i].name = "a-model-with-a-usual-name-" + std::to_string(i);
  return entries;
}

std::vector<CellRun> repeated(std::size_t times, const CellRun& run) { return std::vector<CellRun>(times, run); }

TEST(ServerSession, OneCatalogueServesAllListRequestsUntilTheTransportHasIt) {
  Server server;
  server.catalogue.assign(1000, {"m", ModelState::failed, 0, "broken"});
  server.say_list(10'000);
  EXPECT_EQ(server.lists, 1);
  server.write(100);
  server.say_list(10'000);
  EXPECT_EQ(server.lists, 1) << "most of the answer is still to be sent";
  server.write_all();
  EXPECT_EQ(server.frames()[FrameType::catalogue], 1);
  server.say_list(10'000);
  EXPECT_EQ(server.lists, 2);
  server.write_all();
  EXPECT_EQ(server.frames()[FrameType::catalogue], 1);
}

TEST(ServerSession, UnreadAnswersStopItFromHandlingWhatItHasReceived) {
  Server server;
  server.write_all();
  std::vector<std::byte> pings;
  for (int i = 0; i < 100'000; ++i) encode(FrameType::ping, Ping{1}, pings);
  server.say(pings);
  EXPECT_FALSE(server.session.wants_to_receive());
  while (server.session.wants_to_send()) EXPECT_LT(server.write(1 << 16), kMaxUnsentBytes + 100);
  EXPECT_TRUE(server.session.wants_to_receive());
  EXPECT_EQ(server.frames()[FrameType::pong], 100'000);
}

TEST(ServerSession, ALongReleaseIsWorkedThroughInTurnsAndWhatFollowsWaits) {
  const auto source = std::make_shared<SyntheticSource>(SyntheticShape{21, 1000, 3, 100});
  Server server(source);
  server.say_message(Open{"m", {}});
  server.say_message(Credit{1 << 30});
  server.say_message(Wants{1, {{0, 1000, kAllSegments}}});
  server.write_all();
  ASSERT_EQ(server.session.sent_segments(), source->nonempty_total());

  constexpr std::size_t kTimes = 1000;
  std::vector<std::byte> frames;
  encode(Release{repeated(kTimes, {0, 1000, 0})}, frames);
  encode(Wants{2, {{0, 1000, kAllSegments}}}, frames);
  encode(Wants{3, {{0, 1000, kAllSegments}}}, frames);
  server.say(frames);
  std::size_t turns = 0;
  for (; !server.session.wants_to_receive(); ++turns) {
    ASSERT_TRUE(server.session.wants_to_send());
    ASSERT_EQ(server.write(), 0U) << "neither of the old list nor before the release is done";
  }
  EXPECT_GE(turns, kTimes * 1000 / kEntriesPerTurn);
  EXPECT_LE(turns, kTimes * 1000 / kEntriesPerTurn + 2);
  server.write_all();
  EXPECT_EQ(server.session.sent_segments(), 2 * source->nonempty_total());
  EXPECT_EQ(server.frames()[FrameType::wants_done], 2) << "of the first list and of the last";
}

// What the client keeps of each cell is compared with what the server believes at every frame: a mistake is an error.
TEST(ServerSession, LongReleasesUnderWayKeepBothEndsInStep) {
  constexpr std::uint32_t kCells = 150'000;
  const auto source = std::make_shared<SyntheticSource>(SyntheticShape{26, kCells, 2, 30});
  for (std::uint32_t seed = 0; seed < 3; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const auto below = [&](std::uint32_t end) { return static_cast<std::uint32_t>(random() % end); };
    SessionPair pair;
    pair.open(source);
    pair.run();
    ASSERT_TRUE(pair.client.set_wants({{0, kCells, kAllSegments}}));
    pair.run();
    int waits = 0;
    for (int i = 0; i < 12; ++i) {
      const std::uint32_t first = below(20'000);
      ASSERT_TRUE(pair.client.release({{first, kCells - first, below(2)}}));
      ASSERT_TRUE(pair.client.set_wants({{below(1000), kCells - 1000, 1 + below(2)}}));
      pair.client_to_server();
      waits += pair.server.wants_to_receive() ? 0 : 1;
      pair.server_to_client(below(300'000));
      pair.take_events();
      ASSERT_FALSE(pair.client.failed());
    }
    EXPECT_GT(waits, 0) << "the releases are too short to show anything";
    ASSERT_TRUE(pair.client.set_wants({{0, kCells, kAllSegments}}));
    pair.run();
    ASSERT_FALSE(pair.client.failed());
    for (std::uint32_t cell = 0; cell < kCells; ++cell)
      ASSERT_EQ(pair.client.held_prefix(cell), source->segment_count(cell));
  }
}

TEST(ServerSession, ManyReleasesTogetherAreWorkedThroughInTurns) {
  Server server(std::make_shared<SyntheticSource>(SyntheticShape{22, 1000, 3, 100}));
  server.say_message(Open{"m", {}});
  server.write_all();
  std::vector<std::byte> frames;
  for (int i = 0; i < 1000; ++i) encode(Release{{{0, 1000, 0}}}, frames);
  encode(FrameType::ping, Ping{7}, frames);
  server.say(frames);
  std::size_t turns = 0;
  for (; !server.session.wants_to_receive(); ++turns) server.write();
  EXPECT_GE(turns, 1'000'000 / kEntriesPerTurn);
  server.write_all();
  EXPECT_EQ(server.frames()[FrameType::pong], 1) << "what came behind them is answered";
}

TEST(ServerSession, WhatAClientSaysItHoldsIsWorkedThroughInTurns) {
  const auto source = std::make_shared<SyntheticSource>(SyntheticShape{23, 1000, 3, 100});
  SessionPair pair;
  std::vector<CellRun> held = repeated(1000, {0, 1000, 0});
  held.push_back({0, 500, kAllSegments});
  pair.open(source, Have{source->digest(), true, true, held});
  pair.client_to_server();
  std::size_t turns = 0;
  for (; !pair.server.wants_to_receive(); ++turns) {
    EXPECT_EQ(pair.server.pending_open(), std::nullopt) << "it is answered, if not yet told";
    std::array<Bytes, 64> buffers;
    std::size_t taken = 0;
    for (const Bytes& buffer : std::span(buffers).first(pair.server.next_write(buffers, pair.scratch))) {
      pair.client.receive(buffer, 0);
      taken += buffer.size();
    }
    pair.server.written(taken, 0);
    pair.serve();
  }
  EXPECT_GE(turns, 1'000'000 / kEntriesPerTurn);
  pair.run();
  ASSERT_NE(pair.last<event::ModelOpened>(), nullptr);
  EXPECT_EQ(pair.last<event::ModelOpened>()->model.segment_total, source->segment_total());
  ASSERT_TRUE(pair.client.set_segment_table(source->table()));
  ASSERT_TRUE(pair.client.set_wants({{0, 1000, kAllSegments}}));
  pair.run();
  EXPECT_FALSE(pair.arrived_cells.empty());
  for (const CellPrefix& arrived : pair.arrived_cells) EXPECT_GE(arrived.cell, 500U);
}

TEST(ServerSession, HeldSegmentsThatAreNotThereAreRefusedHoweverLateTheyAreNamed) {
  const auto source = std::make_shared<SyntheticSource>(SyntheticShape{24, 1000, 3, 100});
  Server server(source);
  std::vector<CellRun> held = repeated(200, {0, 1000, 0});
  held.push_back({999, 1, 60'000});
  server.say_message(Open{"m", Have{source->digest(), false, false, held}});
  server.say_message(Wants{1, {{0, 1000, kAllSegments}}});
  EXPECT_EQ(server.frames()[FrameType::error], 0);
  server.write_all();
  EXPECT_EQ(server.frames()[FrameType::error], 1);
  EXPECT_FALSE(server.session.closing());
  server.say_message(Open{"m", {}});
  server.write_all();
  EXPECT_EQ(server.frames()[FrameType::opened], 1);
}

TEST(ServerSession, CreditStaysBelowItsLimitWhenSegmentsAreTakenBack) {
  Server server(std::make_shared<SyntheticSource>(SyntheticShape{25, 1000, 3, 1000}));
  server.say_message(Open{"m", {}});
  server.say_message(Credit{kMaxCredit});
  server.write_all();
  server.say_message(Wants{1, {{0, 1000, kAllSegments}}});
  ASSERT_GT(server.write(0), 0U);
  const std::uint64_t chosen_bytes = kMaxCredit - server.session.credit_bytes();
  ASSERT_GT(chosen_bytes, 0U);
  server.say_message(Credit{chosen_bytes});
  server.say_message(Wants{2, {{0, 1, 1}}});
  ASSERT_FALSE(server.session.closing());
  ASSERT_GT(server.session.credit_bytes(), kMaxCredit);
  server.say_message(Credit{kMaxCredit});
  EXPECT_NE(server.session.close_reason().find("credit"), std::string::npos) << server.session.close_reason();
}

TEST(ServerSession, AClientThatReadsALongAnswerSlowlyIsNotSilent) {
  Server server;
  server.catalogue = largest_catalogue();
  server.say_list();
  std::vector<std::byte> open;
  encode(Open{"nowhere", {}}, open);
  server.say(Bytes(open).first(open.size() / 2));  // the rest waits in the network while the server does not read
  while (!server.session.wants_to_receive()) {
    server.write(12'500);
    server.pass(1000);
    ASSERT_FALSE(server.session.closing()) << server.session.close_reason() << " after " << server.now_ms << " ms";
  }
  EXPECT_GT(server.now_ms, 2 * ServerSessionOptions{}.idle_timeout_ms) << "the answer is too short to show anything";
  for (int i = 0; i < 20; ++i) server.pass(1000);
  EXPECT_FALSE(server.session.closing()) << server.session.close_reason();
  for (int i = 0; i < 20; ++i) server.pass(1000);
  EXPECT_NE(server.session.close_reason().find("stalled"), std::string::npos) << "now it is the client's turn";
}

TEST(ServerSession, SilenceCountsFromTheMomentItReadsAgain) {
  Server server;
  server.catalogue = largest_catalogue();
  server.say_list();
  for (; !server.session.wants_to_receive() && !server.session.closing(); server.pass(1000)) server.write(12'500);
  const TimeMs reads_ms = server.now_ms;
  for (; !server.session.closing() && server.now_ms < reads_ms + 200'000; server.pass(1000)) server.write(12'500);
  EXPECT_NE(server.session.close_reason().find("idle"), std::string::npos) << server.session.close_reason();
  EXPECT_GT(server.now_ms, reads_ms + 85'000);
  EXPECT_LT(server.now_ms, reads_ms + 95'000);
}

TEST(ServerSession, AClientThatTakesNothingOfALongAnswerIsGivenUp) {
  for (const std::size_t taken_bytes : {0, 1'000'000}) {
    Server server;
    server.catalogue = largest_catalogue();
    server.say_list();
    server.write(taken_bytes);
    ASSERT_FALSE(server.session.wants_to_receive());
    for (int i = 0; i < 65 && !server.session.finished(); ++i) server.pass(1000);
    EXPECT_TRUE(server.session.finished());
    EXPECT_NE(server.session.close_reason().find("takes no bytes"), std::string::npos) << server.session.close_reason();
  }
}

}  // namespace
}  // namespace fanstream
