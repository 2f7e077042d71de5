#include <gtest/gtest.h>

#include "tests/unit/protocol/session_pair.h"

namespace fanstream {
namespace {

std::shared_ptr<SyntheticSource> make_source(SyntheticShape shape = {}) {
  return std::make_shared<SyntheticSource>(shape);
}

std::vector<CellRun> everything(const SegmentSource& source) { return {{0, source.cell_count(), kAllSegments}}; }

TEST(Session, WholeModelArrivesExactlyOnceAndInOrder) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    SyntheticShape shape{seed, 40, 5, seed % 4 == 0 ? 200'000U : 700U, seed * 9000U, seed * 5000U};
    const auto source = make_source(shape);
    ClientSessionOptions options;
    options.window_bytes = 2 * kMaxChunkBytes;  // so that credit runs out again and again
    SessionPair pair({}, options);
    ReceivedModel received(*source);
    pair.on_segment = [&](const event::SegmentArrived& s) { EXPECT_TRUE(received.add(s.cell, s.segment, s.bytes)); };
    pair.open(source);
    ASSERT_TRUE(pair.client.set_wants(everything(*source)));
    pair.run();
    EXPECT_TRUE(received.complete());
    EXPECT_EQ(received.segments(), source->nonempty_total());
    EXPECT_TRUE(std::ranges::equal(pair.client.head(), source->head()));
    EXPECT_TRUE(std::ranges::equal(pair.client.index(), source->index()));
    ASSERT_TRUE(pair.last<event::ModelOpened>());
    EXPECT_EQ(pair.last<event::ModelOpened>()->model.digest, source->digest());
    EXPECT_EQ(pair.last<event::ModelOpened>()->model.segment_total, source->segment_total());
    ASSERT_TRUE(pair.last<event::WantsServed>());
    EXPECT_EQ(pair.last<event::WantsServed>()->epoch, 1U);
    EXPECT_EQ(pair.last<event::Failed>(), nullptr);
  }
}

TEST(Session, SegmentsComeInTheOrderOfTheList) {
  const auto source = make_source({3, 30, 4, 100});
  SessionPair pair;
  pair.open(source);
  std::vector<CellPrefix> wants;
  std::vector<CellPrefix> expected;
  for (const std::uint32_t cell : {7U, 3U, 29U, 4U, 3U}) {
    wants.push_back({cell, source->segment_count(cell)});
    if (expected.size() > 0 && cell == 3 && wants.size() == 5) continue;  // named twice, sent once
    for (std::uint32_t s = 0; s < source->segment_count(cell); ++s) {
      if (!source->segment(cell, s).empty()) expected.push_back({cell, s});
    }
  }
  ASSERT_TRUE(pair.client.set_wants(to_runs(wants)));
  pair.run();
  EXPECT_EQ(pair.arrived_cells, expected);
}

TEST(Session, AListByLevelsComesCoarseToFine) {
  const auto source = make_source({18, 80, 5, 300});
  SessionPair pair;
  pair.open(source);
  std::vector<CellRun> levels;
  for (std::uint32_t prefix = 1; prefix <= 5; ++prefix) levels.push_back({0, 80, prefix});
  ASSERT_TRUE(pair.client.set_wants(levels));
  pair.run();
  EXPECT_EQ(pair.arrived_cells.size(), source->nonempty_total());
  EXPECT_TRUE(std::ranges::is_sorted(pair.arrived_cells, {}, &CellPrefix::prefix));
}

TEST(Session, AReplacedListSendsNothingMoreThatTheTransportHadNotTaken) {
  const auto source = make_source({4, 200, 5, 2000});
  for (const std::size_t taken_bytes : {0U, 1U, 100U, 5'000U, 70'001U, 150'000U}) {
    SCOPED_TRACE(taken_bytes);
    SessionPair pair;
    pair.open(source);
    pair.run();
    ASSERT_TRUE(pair.client.set_wants({{0, 100, kAllSegments}}));
    pair.client_to_server();
    const std::size_t moved = pair.server_to_client(taken_bytes);
    ASSERT_EQ(moved, taken_bytes);
    pair.take_events();
    const std::size_t before = pair.arrived_cells.size();
    ASSERT_TRUE(pair.client.set_wants({{100, 100, 1}}));
    pair.run();
    // Of the old list at most the one frame of which bytes were under way.
    std::size_t old_bytes = 0;
    for (std::size_t i = before; i < pair.arrived_cells.size(); ++i) {
      const auto [cell, segment] = pair.arrived_cells[i];
      old_bytes += cell < 100 ? source->segment(cell, segment).size() : 0;
    }
    EXPECT_LE(old_bytes, kBatchBytes);
    ASSERT_TRUE(pair.last<event::WantsServed>());
    EXPECT_EQ(pair.last<event::WantsServed>()->epoch, 2U);
    EXPECT_EQ(pair.last<event::Failed>(), nullptr);
    // Nothing was lost by taking it back: wanting all of it afterwards completes the model.
    ReceivedModel received(*source);
    ASSERT_TRUE(pair.client.set_wants(everything(*source)));
    pair.run();
    EXPECT_EQ(pair.arrived_cells.size(), source->nonempty_total());
  }
}

TEST(Session, ATakenBackSegmentOfSeveralPartsIsSentWholeLater) {
  const auto source = make_source({5, 6, 3, 400'000, 10, 10});
  for (std::size_t taken_bytes = 0; taken_bytes < 300'000; taken_bytes += 33'333) {
    SCOPED_TRACE(taken_bytes);
    SessionPair pair;
    ReceivedModel received(*source);
    pair.on_segment = [&](const event::SegmentArrived& s) { EXPECT_TRUE(received.add(s.cell, s.segment, s.bytes)); };
    pair.open(source);
    pair.run();
    ASSERT_TRUE(pair.client.set_wants(everything(*source)));
    pair.client_to_server();
    pair.server_to_client(taken_bytes);
    ASSERT_TRUE(pair.client.set_wants({{5, 1, kAllSegments}}));
    pair.client_to_server();
    pair.server_to_client(taken_bytes);
    ASSERT_TRUE(pair.client.set_wants(everything(*source)));
    pair.run();
    EXPECT_TRUE(received.complete());
    EXPECT_EQ(pair.last<event::Failed>(), nullptr);
  }
}

TEST(Session, ResumeNeverSendsHeldSegmentsAgain) {
  const auto source = make_source({6, 50, 6, 500});
  Have have{source->digest(), true, true, {}};
  std::vector<CellPrefix> held;
  std::uint64_t held_segments = 0;
  for (std::uint32_t cell = 0; cell < source->cell_count(); ++cell) {
    held.push_back({cell, source->segment_count(cell) / 2});
    for (std::uint32_t s = 0; s < held.back().prefix; ++s) held_segments += source->segment(cell, s).empty() ? 0 : 1;
  }
  have.cells = to_runs(held);
  SessionPair pair;
  pair.open(source, have);
  ASSERT_TRUE(pair.client.set_wants(everything(*source)));
  pair.run();
  ASSERT_TRUE(pair.last<event::ModelOpened>());
  EXPECT_TRUE(pair.last<event::ModelOpened>()->model.resumed);
  EXPECT_EQ(pair.client.head().size(), 0U);
  EXPECT_EQ(pair.arrived_cells.size(), source->nonempty_total() - held_segments);
  for (const CellPrefix& arrived : pair.arrived_cells) EXPECT_GE(arrived.prefix, held[arrived.cell].prefix);
  EXPECT_NE(pair.last<event::WantsServed>(), nullptr);
}

TEST(Session, ResumeOfAnotherDigestStartsFromNothing) {
  const auto source = make_source({7});
  Have have{source->digest(), true, true, {{0, source->cell_count(), kAllSegments}}};
  have.digest[0] ^= 1;
  SessionPair pair;
  pair.open(source, have);
  ASSERT_TRUE(pair.client.set_wants(everything(*source)));
  pair.run();
  EXPECT_FALSE(pair.last<event::ModelOpened>()->model.resumed);
  EXPECT_EQ(pair.arrived_cells.size(), source->nonempty_total());
  EXPECT_TRUE(std::ranges::equal(pair.client.head(), source->head()));
}

TEST(Session, ReleasedSegmentsAreSentAgainEvenWhenSomeWereUnderWay) {
  const auto source = make_source({8, 60, 6, 1500});
  SessionPair pair;
  pair.open(source);
  pair.run();
  ASSERT_TRUE(pair.client.set_wants(everything(*source)));
  pair.client_to_server();
  pair.server_to_client(60'000);
  pair.take_events();
  // More comes while the client drops everything it has.
  pair.server_to_client(30'000);
  const std::size_t before = pair.arrived_cells.size();
  ASSERT_GT(before, 0U);
  ASSERT_TRUE(pair.client.release({{0, source->cell_count(), 0}}));
  ReceivedModel received(*source);
  pair.on_segment = [&](const event::SegmentArrived& s) { EXPECT_TRUE(received.add(s.cell, s.segment, s.bytes)); };
  // Cells that had nothing yet were not released, so the stale segments of those count as new.
  ASSERT_TRUE(pair.client.set_wants(everything(*source)));
  pair.run();
  EXPECT_TRUE(received.complete());
  EXPECT_EQ(pair.last<event::Failed>(), nullptr);
}

TEST(Session, WithoutCreditNothingIsSentAndTheClientIsTold) {
  const auto source = make_source({9, 10, 3, 400});
  ServerSession server({}, 0);
  std::vector<std::byte> input;
  encode(Hello{}, input);
  encode(Open{"model", {}}, input);
  encode(Wants{1, {{0, 10, kAllSegments}}}, input);
  server.receive(input, 0);
  while (server.next_event(0)) {
    server.open_ready(source);
  }
  FrameReader reader(Receiver::client);
  std::vector<FrameType> types;
  std::vector<std::byte> scratch;
  const auto pull = [&](TimeMs now_ms) {
    std::array<Bytes, 64> buffers;
    while (server.wants_to_send()) {
      const std::size_t count = server.next_write(buffers, scratch);
      if (count == 0) break;
      std::size_t size = 0;
      for (const Bytes& buffer : std::span(buffers).first(count)) {
        reader.push(buffer);
        size += buffer.size();
      }
      server.written(size, now_ms);
    }
    for (auto frame = reader.next(); frame && *frame; frame = reader.next()) types.push_back((*frame)->type);
  };
  pull(0);
  EXPECT_EQ(types, (std::vector{FrameType::welcome, FrameType::opened}));
  types.clear();
  for (TimeMs now_ms = 1000; now_ms <= 8000; now_ms += 1000) server.tick(now_ms);
  pull(8000);
  EXPECT_EQ(types, (std::vector{FrameType::degraded}));
  types.clear();
  input.clear();
  encode(Credit{3000}, input);  // the head, exactly
  server.receive(input, 8000);
  EXPECT_FALSE(server.next_event(8000));
  pull(8000);
  EXPECT_EQ(types, (std::vector{FrameType::head_data}));
  EXPECT_EQ(server.credit_bytes(), 0U);
}

TEST(Session, VersionMismatchIsSaidWithBothRanges) {
  ClientSessionOptions options;
  options.version_min = 7;
  options.version_max = 9;
  SessionPair pair({}, options);
  pair.run();
  ASSERT_TRUE(pair.last<event::Failed>());
  EXPECT_EQ(pair.last<event::Failed>()->error.kind, ErrorKind::unsupported);
  EXPECT_NE(pair.last<event::Failed>()->error.message.find("7 to 9"), std::string::npos);
  EXPECT_TRUE(pair.server.finished());
}

TEST(Session, UnknownModelIsRefusedAndAnotherMayBeOpened) {
  const auto source = make_source({10});
  SessionPair pair;
  pair.table = source->table();
  pair.on_server_event = [&](const ServerEvent& event) {
    const auto* open = std::get_if<OpenRequested>(&event);
    ASSERT_TRUE(open);
    open->model == "there" ? pair.server.open_ready(source)
                           : pair.server.open_failed(ErrorCode::unknown_model, "no such");
  };
  pair.run();
  ASSERT_TRUE(pair.client.open("missing"));
  ASSERT_TRUE(pair.client.set_wants({{0, 1, 1}}));
  pair.run();
  ASSERT_TRUE(pair.last<event::Refused>());
  EXPECT_EQ(pair.last<event::Refused>()->code, ErrorCode::unknown_model);
  EXPECT_NE(pair.last<event::Refused>()->text.find("missing"), std::string::npos);
  ASSERT_TRUE(pair.client.open("there"));
  ASSERT_TRUE(pair.client.set_wants(everything(*source)));
  pair.run();
  EXPECT_EQ(pair.arrived_cells.size(), source->nonempty_total());
}

TEST(Session, WantsOutOfRangeAreRefusedAndTheNextListIsServed) {
  const auto source = make_source({11, 20});
  for (const CellRun bad : {CellRun{20, 1, 1}, CellRun{15, 6, kAllSegments}, CellRun{4'000'000, 1, 0}}) {
    SessionPair pair;
    pair.open(source);
    ASSERT_TRUE(pair.client.set_wants({bad}));
    pair.run();
    ASSERT_TRUE(pair.last<event::Refused>());
    EXPECT_EQ(pair.last<event::Refused>()->code, ErrorCode::want_out_of_range);
    EXPECT_FALSE(pair.client.wants_outstanding());
    ASSERT_TRUE(pair.client.set_wants(everything(*source)));
    pair.run();
    EXPECT_EQ(pair.arrived_cells.size(), source->nonempty_total());
  }
}

TEST(Session, BuildingIsReportedUntilTheModelIsReady) {
  const auto source = make_source({12});
  SessionPair pair;
  pair.run();
  ASSERT_TRUE(pair.client.open("model"));
  std::vector<double> fractions;
  for (int percent = 0; percent <= 90; percent += 30) {
    pair.client_to_server();
    pair.server.open_building(percent / 100.0, pair.now_ms);
    pair.run();
    fractions.push_back(pair.last<event::BuildingModel>()->fraction);
  }
  EXPECT_EQ(fractions, (std::vector{0.0, 0.3, 0.6, 0.9}));
  pair.server.open_ready(source);
  pair.run();
  EXPECT_NE(pair.last<event::IndexComplete>(), nullptr);
}

TEST(Session, AFloodOfListRequestsGetsOneAnswer) {
  SessionPair pair;
  int asked = 0;
  pair.on_server_event = [&](const ServerEvent&) { ++asked; };
  pair.run();
  for (int i = 0; i < 10'000; ++i) pair.client.list();
  pair.client_to_server();
  EXPECT_EQ(asked, 1);
}

TEST(Session, UnreadAnswersStopTheServerFromReading) {
  ServerSession server({}, 0);
  std::vector<std::byte> input;
  encode(Hello{}, input);
  server.receive(input, 0);
  EXPECT_FALSE(server.next_event(0));
  input.clear();
  for (int i = 0; i < 1000; ++i) encode(FrameType::ping, Ping{1}, input);
  std::size_t taken = 0;
  while (server.wants_to_receive() && taken < 10'000'000) {
    server.receive(input, 0);
    taken += input.size();
    EXPECT_FALSE(server.next_event(0));
  }
  EXPECT_LT(taken, 1'000'000U);
}

TEST(Session, SilenceIsAnsweredByPingAndThenByTheEnd) {
  SessionPair pair;
  pair.run();
  for (pair.now_ms = 0; pair.now_ms < 300'000; pair.now_ms += 1000) {
    pair.server.tick(pair.now_ms);
    pair.client.tick(pair.now_ms);
    pair.run();
  }
  EXPECT_FALSE(pair.server.closing());
  EXPECT_FALSE(pair.client.failed());

  for (; pair.now_ms < 600'000 && !pair.server.closing(); pair.now_ms += 1000) {
    pair.server.tick(pair.now_ms);
    pair.server_to_client();  // which no longer answers
  }
  EXPECT_NE(pair.server.close_reason().find("idle"), std::string::npos);
}

TEST(Session, AHandshakeThatDoesNotComeEndsTheSession) {
  ServerSession server({}, 0);
  server.receive(Bytes(std::array{std::byte{1}}), 0);
  EXPECT_FALSE(server.next_event(0));
  for (TimeMs now_ms = 0; now_ms < 12'000; now_ms += 1000) server.tick(now_ms);
  EXPECT_NE(server.close_reason().find("handshake"), std::string::npos);
}

TEST(Session, AFrameThatTricklesInEndsTheSession) {
  SessionPair pair;
  pair.run();
  std::vector<std::byte> frame;
  encode(Open{"a model with a long name", {}}, frame);
  TimeMs now_ms = 0;
  for (const std::byte byte : frame) {
    pair.server.receive(Bytes(&byte, 1), now_ms += 2000);
    EXPECT_FALSE(pair.server.next_event(now_ms));
    pair.server.tick(now_ms);
    if (pair.server.closing()) break;
  }
  EXPECT_NE(pair.server.close_reason().find("stalled"), std::string::npos);
}

TEST(Session, AClientThatTakesNoBytesIsGivenUp) {
  const auto source = make_source({13});
  SessionPair pair;
  pair.open(source);
  pair.client_to_server();
  for (TimeMs now_ms = 0; now_ms < 70'000; now_ms += 1000) {
    std::vector<std::byte> alive;
    encode(FrameType::pong, Ping{}, alive);
    pair.server.receive(alive, now_ms);
    EXPECT_FALSE(pair.server.next_event(now_ms));
    pair.server.tick(now_ms);
  }
  EXPECT_TRUE(pair.server.finished());
}

TEST(Session, AServerThatStopsInTheMiddleIsNoticedByTheClient) {
  const auto source = make_source({14});
  SessionPair pair;
  pair.open(source);
  pair.run();
  ASSERT_TRUE(pair.client.set_wants(everything(*source)));
  for (TimeMs now_ms = 0; now_ms < 40'000; now_ms += 500) pair.client.tick(now_ms);
  pair.take_events();
  ASSERT_TRUE(pair.last<event::Failed>());
  EXPECT_NE(pair.last<event::Failed>()->error.message.find("wanted segments"), std::string::npos);
}

TEST(Session, TimeInWhichTheDriverWasAwayIsNoStall) {
  const auto source = make_source({15});
  SessionPair pair;
  pair.open(source);
  pair.run();
  ASSERT_TRUE(pair.client.set_wants(everything(*source)));
  pair.client.tick(0);
  pair.client.tick(500'000);
  EXPECT_FALSE(pair.client.failed());
}

TEST(Session, GoodbyeReachesTheClientAndDropsWhatWasNotUnderWay) {
  const auto source = make_source({16, 100, 5, 2000});
  SessionPair pair;
  pair.open(source);
  ASSERT_TRUE(pair.client.set_wants(everything(*source)));
  pair.client_to_server();
  pair.server_to_client(50'000);
  pair.server.close(ErrorCode::shutting_down, "the server is shutting down");
  EXPECT_LT(pair.server_to_client(), 40'000U);
  EXPECT_TRUE(pair.server.finished());
  pair.take_events();
  ASSERT_TRUE(pair.last<event::Failed>());
  EXPECT_NE(pair.last<event::Failed>()->error.message.find("shutting down"), std::string::npos);
}

TEST(Session, ASegmentDamagedOnItsWayIsNamed) {
  const auto source = make_source({17, 20, 3, 900});
  SessionPair pair;
  pair.open(source);
  pair.run();
  ASSERT_TRUE(pair.client.set_wants(everything(*source)));
  pair.client_to_server();
  std::array<Bytes, 64> buffers;
  const std::size_t count = pair.server.next_write(buffers, pair.scratch);
  std::vector<std::byte> bytes;
  for (const Bytes& buffer : std::span(buffers).first(count)) bytes.insert(bytes.end(), buffer.begin(), buffer.end());
  bytes[bytes.size() / 2] ^= std::byte{4};
  pair.client.receive(bytes, 0);
  pair.take_events();
  ASSERT_TRUE(pair.last<event::Failed>());
  EXPECT_NE(pair.last<event::Failed>()->error.message.find("stream byte"), std::string::npos);
}

TEST(Session, WantsForTenThousandCellsAreASmallMessage) {
  std::vector<std::byte> out;
  encode(Wants{1, {{0, 10'000, kAllSegments}}}, out);
  EXPECT_LE(out.size(), 12U);
  // A list ordered by importance, with no runs at all.
  std::vector<CellPrefix> scattered;
  for (std::uint32_t i = 0; i < 10'000; ++i) scattered.push_back({i * 7919 % 10'000, 1 + i % 8});
  out.clear();
  encode(Wants{2, to_runs(scattered)}, out);
  EXPECT_LE(out.size(), 35'000U);
}

}  // namespace
}  // namespace fanstream
