// A model comes whole over connections that are cut, refused, stalled and lied on, or the client says why not.
#include "client/net/reconnecting_client.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "tests/support/built_model.h"
#include "tests/support/cutting_relay.h"

namespace fanstream {
namespace {

using testing::RepeatedlyCuttingRelay;

ReconnectOptions hasty() {
  ReconnectOptions options;
  options.first_retry_ms = 1;
  options.max_retry_ms = 4;
  options.give_up_after_ms = 300'000;
  options.jitter_seed = 7;
  return options;
}

struct Tally {
  unsigned lost = 0, retries = 0, resumed = 0;
};

class ReconnectingClientTest : public ::testing::Test {
 protected:
  void SetUp() override { models.add("model", source); }
  std::vector<CellRun> everything() const { return {{0, source->cell_count(), kAllSegments}}; }

  static ServerAddress at(std::uint16_t port) { return {"127.0.0.1", port, "model"}; }

  std::unique_ptr<ReconnectingClient> open(std::uint16_t port, const ReconnectOptions& options,
                                           std::optional<HeldAsset> held = {}) const {
    auto client = ReconnectingClient::start(at(port), options, std::move(held));
    if (!client) return nullptr;
    const auto index = (*client)->receive_index();
    EXPECT_TRUE(index) << index.error().message;
    if (!index) return nullptr;
    EXPECT_TRUE((*client)->set_segment_table(source->table()));
    return std::move(*client);
  }

  // Until the list is served, so many segments have come, or an error.
  static std::optional<Error> receive(ReconnectingClient& client, ReceivedModel& received, Tally& tally,
                                      std::uint64_t most = ~0ULL) {
    while (client.wants_outstanding() && received.segments() < most) {
      const auto event = client.next_event(10'000);
      if (!event) return event.error();
      if (!*event) return Error{ErrorKind::network, "silence"};
      if (const auto* segment = std::get_if<event::SegmentArrived>(&**event)) {
        EXPECT_TRUE(received.add(segment->cell, segment->segment, segment->bytes)) << "once, in order, exact";
      }
      tally.lost += std::holds_alternative<event::ConnectionLost>(**event) ? 1 : 0;
      tally.retries += std::holds_alternative<event::Retrying>(**event) ? 1 : 0;
      tally.resumed += std::holds_alternative<event::ConnectionResumed>(**event) ? 1 : 0;
    }
    return std::nullopt;
  }

  std::shared_ptr<SyntheticSource> source =
      std::make_shared<SyntheticSource>(SyntheticShape{1, 300, 10, 80, 2000, 700});
  testing::ModelServer models;
};

TEST_F(ReconnectingClientTest, WhateverByteTheConnectionIsCutAtEverySegmentComesExactlyOnce) {
  for (const std::size_t cut : {4'800U, 5'001U, 7'777U, 12'345U, 33'333U}) {
    SCOPED_TRACE(cut);
    RepeatedlyCuttingRelay relay(models.port(), [&](unsigned n) { return cut + n % 97; });
    const auto client = open(relay.port(), hasty());
    ASSERT_TRUE(client);
    ASSERT_TRUE(client->set_wants(everything()));
    ReceivedModel received(*source);
    Tally tally;
    const auto error = receive(*client, received, tally);
    ASSERT_FALSE(error) << error->message;
    EXPECT_TRUE(received.complete());
    EXPECT_EQ(received.segments(), source->nonempty_total());
    EXPECT_TRUE(std::ranges::equal(client->head(), source->head()));
    EXPECT_TRUE(std::ranges::equal(client->index(), source->index()));
    EXPECT_GE(tally.lost, source->size_bytes() / (cut + 97) - 1);
    EXPECT_EQ(tally.resumed, tally.lost);
    EXPECT_GE(tally.retries, tally.lost);
    // What is lost of a connection is at most a frame begun, and the greeting.
    EXPECT_LE(client->received_bytes(),
              source->size_bytes() + source->nonempty_total() * 2 + client->connections() * (kBatchBytes + 200U));
  }
}

// Every byte of the greeting, of the head, and so on: each connection ends one byte later than the one before.
TEST_F(ReconnectingClientTest, CutAtEveryByteInTurnItIsStillExact) {
  const auto small = std::make_shared<SyntheticSource>(SyntheticShape{2, 30, 4, 60, 150, 100});
  models.add("model", small);
  source = small;
  RepeatedlyCuttingRelay relay(models.port(), [](unsigned n) { return n == 0 ? 100 : 20 + n; });
  const auto client = open(relay.port(), hasty());
  ASSERT_TRUE(client);
  ASSERT_TRUE(client->set_wants(everything()));
  ReceivedModel received(*source);
  Tally tally;
  const auto error = receive(*client, received, tally);
  ASSERT_FALSE(error) << error->message;
  EXPECT_TRUE(received.complete());
  EXPECT_GT(relay.connections(), 300U);
}

// Nobody takes events while a head is waited for: who waits would otherwise hear nothing of it for minutes.
TEST_F(ReconnectingClientTest, WhatHappensToTheConnectionIsToldWhileAHeadIsWaitedFor) {
  RepeatedlyCuttingRelay relay(models.port(), [](unsigned n) { return n < 3 ? 100 : 1U << 20U; });
  ReconnectOptions options = hasty();
  std::vector<std::string> told;
  options.on_notice = [&](const std::string& text) { told.push_back(text); };
  const auto client = ReconnectingClient::start(at(relay.port()), options);
  ASSERT_TRUE(client);
  const auto head = (*client)->receive_head();
  ASSERT_TRUE(head) << head.error().message;
  const auto count = [&](const std::string& start) {
    return std::count_if(told.begin(), told.end(), [&](const std::string& text) { return text.starts_with(start); });
  };
  EXPECT_GE(count("the connection was lost: 127.0.0.1:"), 1);
  EXPECT_EQ(count("connecting again, attempt "), 3);
  EXPECT_GE(count("connected again after "), 1);
  EXPECT_LE(told.size(), 9U);
}

TEST_F(ReconnectingClientTest, ReleasesAndNewListsSurviveTheLossOfTheConnection) {
  RepeatedlyCuttingRelay relay(models.port(), [](unsigned n) { return 9'000 + 111 * n; });
  const auto client = open(relay.port(), hasty());
  ASSERT_TRUE(client);
  std::vector<std::uint32_t> held(source->cell_count(), 0);
  std::uint32_t state = 12345;
  const auto random = [&](std::uint32_t below) { return (state = state * 1664525U + 1013904223U) / 65536U % below; };
  for (int round = 0; round < 120; ++round) {
    const std::uint32_t cell = random(source->cell_count());
    const std::uint32_t count = 1 + random(source->cell_count() - cell);
    if (round % 3 == 2) {
      ASSERT_TRUE(client->release({{cell, count, 2}}));
      for (std::uint32_t i = cell; i < cell + count; ++i) held[i] = std::min(held[i], 2U);
    }
    ASSERT_TRUE(client->set_wants({{cell, count, random(12)}}));
    for (int i = 0; i < 60 && client->wants_outstanding(); ++i) {
      const auto event = client->next_event(10'000);
      ASSERT_TRUE(event) << event.error().message;
      ASSERT_TRUE(*event);
      const auto* segment = std::get_if<event::SegmentArrived>(&**event);
      if (segment == nullptr) continue;
      ASSERT_EQ(segment->segment, source->table()->next_to_send(segment->cell, held[segment->cell]));
      ASSERT_TRUE(std::ranges::equal(segment->bytes, source->segment(segment->cell, segment->segment)));
      held[segment->cell] = segment->segment + 1;
    }
  }
  ReceivedModel unused(*source);
  for (std::uint32_t cell = 0; cell < held.size(); ++cell) {
    ASSERT_EQ(client->held_prefix(cell), source->table()->next_to_send(cell, held[cell]));
  }
  EXPECT_GT(relay.connections(), 5U);
}

// What is held is stated when a connection begins, and may be dropped before the server has read it.
TEST_F(ReconnectingClientTest, WhatIsReleasedWhileConnectingComesAgainWhenItIsWanted) {
  for (const std::uint32_t prefix : {0U, 2U}) {
    SCOPED_TRACE(prefix);
    RepeatedlyCuttingRelay relay(models.port(), [](unsigned n) { return n == 0 ? 30'000U : 1U << 30; });
    const auto client = open(relay.port(), hasty());
    ASSERT_TRUE(client);
    ASSERT_TRUE(client->set_wants(everything()));
    std::vector<std::uint32_t> held(source->cell_count(), 0);
    const auto receive_until = [&](TimeMs timeout_ms, const auto& done) {
      while (!done()) {
        const auto event = client->next_event(timeout_ms);
        ASSERT_TRUE(event) << event.error().message;
        if (!*event) continue;
        if (const auto* segment = std::get_if<event::SegmentArrived>(&**event)) {
          ASSERT_EQ(segment->segment, source->table()->next_to_send(segment->cell, held[segment->cell]));
          held[segment->cell] = segment->segment + 1;
        }
      }
    };
    // Polled without waiting, the second connection does not come to be before the release.
    receive_until(0, [&] { return client->connections() == 2; });
    ASSERT_TRUE(client->release({{0, source->cell_count(), prefix}}));
    std::uint32_t dropped = 0;
    for (std::uint32_t& h : held) {
      dropped += h > prefix ? 1 : 0;
      h = std::min(h, prefix);
    }
    ASSERT_GT(dropped, 0U);
    ASSERT_TRUE(client->set_wants(everything()));
    receive_until(10'000, [&] { return !client->wants_outstanding(); });
    for (std::uint32_t cell = 0; cell < held.size(); ++cell) {
      ASSERT_EQ(source->table()->next_to_send(cell, held[cell]), source->segment_count(cell)) << cell;
      ASSERT_EQ(client->held_prefix(cell), source->segment_count(cell)) << cell;
    }
  }
}

TEST_F(ReconnectingClientTest, AReleaseMayHaveAnyNumberOfRuns) {
  const auto client = open(models.port(), hasty());
  ASSERT_TRUE(client);
  const std::vector<CellRun> runs(kMaxRuns + 1, CellRun{0, 1, 0});
  const auto released = client->release(runs);
  EXPECT_TRUE(released) << released.error().message;
  EXPECT_FALSE(client->release({{source->cell_count(), 1, 0}}));
}

TEST_F(ReconnectingClientTest, WhatWasHeldBeforeIsNotAskedForAgain) {
  HeldAsset held{source->digest(),
                 {source->head().begin(), source->head().end()},
                 {source->index().begin(), source->index().end()},
                 {}};
  ReceivedModel received(*source);
  for (std::uint32_t cell = 0; cell < source->cell_count(); ++cell) {
    held.prefixes.push_back(source->segment_count(cell) / 2);
    for (std::uint32_t s = 0; s < held.prefixes.back(); ++s) {
      if (source->segment(cell, s).empty()) continue;
      ASSERT_TRUE(received.add(cell, s, source->segment(cell, s)));
    }
  }
  const std::uint64_t before = received.segments();
  const auto client = open(models.port(), hasty(), held);
  ASSERT_TRUE(client);
  EXPECT_TRUE(client->model()->resumed);
  ASSERT_TRUE(client->set_wants(everything()));
  Tally tally;
  ASSERT_FALSE(receive(*client, received, tally));
  EXPECT_TRUE(received.complete());
  EXPECT_LT(client->received_bytes(), source->size_bytes() * 3 / 4);
  EXPECT_GT(before, 0U);

  held.digest[5] ^= 1;  // of another asset: it is dropped, and the caller can see it
  const auto other = open(models.port(), hasty(), held);
  ASSERT_TRUE(other);
  EXPECT_FALSE(other->model()->resumed);
  EXPECT_EQ(other->held_prefix(0), source->table()->next_to_send(0, 0));
  EXPECT_TRUE(std::ranges::equal(other->index(), source->index()));
}

TEST_F(ReconnectingClientTest, AModelThatWasReplacedMeanwhileIsAClearError) {
  RepeatedlyCuttingRelay relay(models.port(), [](unsigned) { return 9'000; });
  const auto client = open(relay.port(), hasty());
  ASSERT_TRUE(client);
  models.add("model", std::make_shared<SyntheticSource>(SyntheticShape{99, 300, 10, 80, 2000, 700}));
  ASSERT_TRUE(client->set_wants(everything()));
  ReceivedModel received(*source);
  Tally tally;
  const auto error = receive(*client, received, tally);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->kind, ErrorKind::bad_input);
  EXPECT_NE(error->message.find("replaced"), std::string::npos) << error->message;
  EXPECT_EQ(tally.lost, 1U);
  const auto again = client->next_event(0);
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().message, error->message);
}

TEST_F(ReconnectingClientTest, AServerThatStaysAwayIsGivenUpWithWhatWasTried) {
  ReconnectOptions options = hasty();
  options.give_up_after_ms = 300;
  auto relay = std::make_unique<RepeatedlyCuttingRelay>(models.port(), [](unsigned) { return 9'000; });
  const auto client = open(relay->port(), options);
  ASSERT_TRUE(client);
  ASSERT_TRUE(client->set_wants(everything()));
  ReceivedModel received(*source);
  Tally tally;
  ASSERT_FALSE(receive(*client, received, tally, 50));
  models.server->stop();
  const auto error = receive(*client, received, tally);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->kind, ErrorKind::network);
  EXPECT_NE(error->message.find("given up after " + std::to_string(tally.retries) + " attempts"), std::string::npos)
      << error->message;
  EXPECT_NE(error->message.find("127.0.0.1:"), std::string::npos);
  EXPECT_GE(received.segments(), 50U);
}

// A server that accepts and breaks off before anything new has come makes no progress, however often it resumes.
TEST_F(ReconnectingClientTest, ResumingWithoutProgressIsNoReasonToGoOn) {
  ReconnectOptions options = hasty();
  options.give_up_after_ms = 300;
  RepeatedlyCuttingRelay relay(models.port(), [](unsigned n) { return n == 0 ? 9'000U : 120U; });
  const auto client = open(relay.port(), options);
  ASSERT_TRUE(client);
  ASSERT_TRUE(client->set_wants(everything()));
  ReceivedModel received(*source);
  Tally tally;
  const auto error = receive(*client, received, tally);
  ASSERT_TRUE(error);
  EXPECT_NE(error->message.find("given up"), std::string::npos) << error->message;
  EXPECT_GT(tally.resumed, 3U);
}

TEST_F(ReconnectingClientTest, TheFirstConnectionFailsAtOnceAndByName) {
  std::uint16_t unused = 0;
  {
    const RawListener listener;
    unused = listener.port();
  }
  auto client = ReconnectingClient::start(at(unused), hasty());
  ASSERT_TRUE(client);
  const auto opened = (*client)->wait_until_opened();
  ASSERT_FALSE(opened);
  EXPECT_NE(opened.error().message.find("refused"), std::string::npos) << opened.error().message;
  auto missing = ReconnectingClient::start({"127.0.0.1", models.port(), "missing"}, hasty());
  ASSERT_TRUE(missing);
  const auto refused = (*missing)->wait_until_opened();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::not_found);
  EXPECT_FALSE(ReconnectingClient::start({"127.0.0.1", models.port(), ""}, hasty()));
}

TEST_F(ReconnectingClientTest, StopEndsTheWaitForTheNextAttempt) {
  std::atomic<bool> stop{false};
  ReconnectOptions options = hasty();
  options.first_retry_ms = options.max_retry_ms = 1'000'000'000;
  options.give_up_after_ms = 4'000'000'000;
  options.client.stop = &stop;
  RepeatedlyCuttingRelay relay(models.port(), [](unsigned) { return 9'000; });
  const auto client = open(relay.port(), options);
  ASSERT_TRUE(client);
  ASSERT_TRUE(client->set_wants(everything()));
  ReceivedModel received(*source);
  std::thread stopper([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    stop = true;
  });
  Tally tally;
  const auto error = receive(*client, received, tally);  // hangs where stop is not honoured
  stopper.join();
  ASSERT_TRUE(error);
  EXPECT_EQ(error->kind, ErrorKind::interrupted);
}

TEST_F(ReconnectingClientTest, ASmallTimeoutNeverWaitsForAServerThatIsAway) {
  ReconnectOptions options = hasty();
  options.first_retry_ms = options.max_retry_ms = 1'000'000'000;
  options.give_up_after_ms = 4'000'000'000;
  RepeatedlyCuttingRelay relay(models.port(), [](unsigned) { return 9'000; });
  const auto client = open(relay.port(), options);
  ASSERT_TRUE(client);
  ASSERT_TRUE(client->set_wants(everything()));
  bool retrying = false;
  while (!retrying) {
    const auto event = client->next_event(1'000);
    ASSERT_TRUE(event && *event);
    retrying = std::holds_alternative<event::Retrying>(**event);
  }
  for (int i = 0; i < 10; ++i) {
    const auto event = client->next_event(0);
    ASSERT_TRUE(event);
    EXPECT_FALSE(*event);
  }
  EXPECT_TRUE(client->set_wants(everything()));
  EXPECT_TRUE(client->release({{0, 10, 0}}));
}

// What is said at once, and what when the client has said what it wants.
struct Script {
  std::vector<std::byte> greeting, rest;
};

// Opens as the real server does, then says what the test has prepared, to each connection the next.
class LyingServer {
 public:
  explicit LyingServer(std::vector<Script> scripts)
      : thread_([this, scripts = std::move(scripts)] {
          for (const auto& script : scripts) {
            RawSocket socket = listener_.accept();
            if (stopping_) return;
            socket.send(script.greeting);
            FrameReader reader(Receiver::server);
            for (bool wanted = false; !wanted && !socket.ended();) {
              reader.push(socket.receive_next());
              for (auto frame = reader.next(); frame && *frame; frame = reader.next())
                wanted = wanted || (*frame)->type == FrameType::wants;
            }
            socket.send(script.rest);
            while (!socket.receive_next().empty()) {
            }
          }
        }) {}
  ~LyingServer() {
    stopping_ = true;
    RawSocket::connect(listener_.port());
    thread_.join();
  }
  std::uint16_t port() const { return listener_.port(); }

 private:
  RawListener listener_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

class LyingServerTest : public ::testing::Test {
 protected:
  // Cells of one, two and no segments, of 10 bytes each.
  LyingServerTest() {
    auto made = std::make_shared<SegmentTable>();
    made->add_cell(std::vector<std::uint32_t>{10});
    made->add_cell(std::vector<std::uint32_t>{10, 10});
    made->add_cell({});
    table = made;
    opened.cell_count = 3;
    opened.segment_total = 3;
    opened.digest = {1, 2, 3};
  }
  static Script script(const Opened& model) {
    Script made;
    encode(Welcome{}, made.greeting);
    encode(model, made.greeting);
    return made;
  }
  static void add_batch(const std::vector<BatchRun>& runs, std::size_t size, std::vector<std::byte>& bytes) {
    std::vector<std::byte> frame(kDataContentAt);
    WireWriter writer(frame);
    write_batch_fields(0, runs, writer);
    frame.resize(frame.size() + size);
    seal_data_frame(FrameType::segments, frame);
    bytes.insert(bytes.end(), frame.begin(), frame.end());
  }
  // What a client of everything makes of it in the end, with the segments it got.
  std::string outcome(std::vector<Script> scripts, std::vector<CellRun> wants) const {
    LyingServer server(std::move(scripts));
    ReconnectOptions options = hasty();
    options.give_up_after_ms = 1'500;
    options.client.connect_timeout_ms = 300;
    options.client.session.stall_timeout_ms = 300;
    auto client = ReconnectingClient::start({"127.0.0.1", server.port(), "model"}, options);
    if (!client) return client.error().message;
    if (const auto index = (*client)->receive_index(); !index) return index.error().message;
    if (const auto set = (*client)->set_segment_table(table); !set) return set.error().message;
    EXPECT_TRUE((*client)->set_wants(std::move(wants)));
    std::string text;
    for (int i = 0; i < 10'000; ++i) {
      const auto event = (*client)->next_event(5'000);
      if (!event) return text + event.error().message;
      if (!*event) return text + "silence";
      if (const auto* s = std::get_if<event::SegmentArrived>(&**event))
        text += std::to_string(s->cell) + "." + std::to_string(s->segment) + " ";
      if (const auto* lost = std::get_if<event::ConnectionLost>(&**event))
        text += "lost: " + lost->reason.message + " ";
      if (const auto* told = std::get_if<event::ServerDegraded>(&**event)) text += "degraded: " + told->text + " ";
      if (!(*client)->wants_outstanding()) return text + "done";
    }
    return text + "endless";
  }
  static void has(const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  }

  std::shared_ptr<const SegmentTable> table;
  Opened opened;
  const std::vector<CellRun> all = {{0, 3, kAllSegments}};
};

TEST_F(LyingServerTest, ASegmentNeverWantedEndsTheSessionByName) {
  Script lie = script(opened);
  add_batch({{1, 1, 2}}, 20, lie.rest);
  has(outcome({lie}, {{0, 3, 1}}), "nobody wanted");
}

TEST_F(LyingServerTest, SegmentsOutOfOrderOrTooManyEndTheSessionByName) {
  Script lie = script(opened);
  add_batch({{0, 1, 1}, {0, 1, 1}}, 20, lie.rest);
  has(outcome({lie}, all), "no more than its 1 segments");
}

TEST_F(LyingServerTest, AWrongDigestOnResumeIsAClearError) {
  Script first = script(opened);
  add_batch({{0, 1, 1}}, 10, first.rest);
  first.rest.push_back(
      std::byte{static_cast<unsigned char>(FrameType::segments)});  // and stalls in the middle of a frame
  Opened other = opened;
  other.digest[0] ^= 1;
  const std::string text = outcome({first, script(other)}, all);
  has(text, "0.0 lost: ");
  has(text, "stalled");
  has(text, "replaced");
}

TEST_F(LyingServerTest, AServerThatForgetsWhatIsHeldIsAClearError) {
  Script first = script(opened);
  add_batch({{0, 1, 1}}, 10, first.rest);
  has(outcome({first, script(opened)}, all), "does not go on where it was");
}

TEST_F(LyingServerTest, AServerThatStallsIsLeftAndTriedAgain) {
  Opened resumed = opened;
  resumed.resumed = true;
  Script first = script(opened), second = script(resumed);
  add_batch({{0, 1, 1}}, 10, first.rest);
  add_batch({{1, 1, 2}}, 20, second.rest);
  encode(WantsDone{1, 0}, second.rest);
  const std::string text = outcome({first, second}, all);
  has(text, "0.0 lost: ");
  has(text, "1.0 1.1 done");
}

TEST_F(LyingServerTest, AFloodIsRefusedOrStated) {
  Script unasked = script(opened), pings = script(opened), notices = script(opened);
  for (int i = 0; i < 1000; ++i) {
    encode_catalogue({}, unasked.rest);
    encode(Degraded{DegradedReason::no_credit, "wait"}, notices.rest);
  }
  for (int i = 0; i < 100'000; ++i) encode(FrameType::ping, Ping{}, pings.rest);
  add_batch({{0, 1, 1}, {1, 1, 2}}, 30, pings.rest);
  encode(WantsDone{1, 0}, pings.rest);
  has(outcome({unasked}, all), "catalogue without being asked");
  has(outcome({notices}, all), "degraded: wait degraded: wait");
  const std::string text = outcome({pings}, all);
  EXPECT_TRUE(text.find("without reading our answers") != std::string::npos || text == "0.0 1.0 1.1 done") << text;
}

TEST_F(LyingServerTest, AListSaidToBeServedThatIsNotEndsTheSessionByName) {
  Script lie = script(opened);
  add_batch({{0, 1, 1}, {1, 1, 1}}, 20, lie.rest);
  encode(WantsDone{1, 0}, lie.rest);
  const std::string text = outcome({lie}, all);
  has(text, "0.0 1.0 ");
  has(text, "without having sent segment 1 of cell 1");
}

TEST(StatePrefixes, TooManyDifferentOnesAreRoundedDown) {
  std::vector<std::uint32_t> prefixes(400'000);
  for (std::size_t cell = 0; cell < prefixes.size(); ++cell) prefixes[cell] = static_cast<std::uint32_t>(1 + cell % 3);
  const std::vector<CellRun> runs = state_prefixes(prefixes);
  EXPECT_TRUE(check_runs(runs));
  std::uint64_t stated = 0;
  for (const CellRun& run : runs) {
    for (std::uint32_t cell = run.first_cell; cell < run.first_cell + run.cell_count; ++cell) {
      ASSERT_LE(run.prefix, prefixes[cell]);
      ++stated;
    }
  }
  EXPECT_EQ(stated, prefixes.size());
  prefixes.assign(1000, 0);
  prefixes[500] = 3;
  EXPECT_EQ(state_prefixes(prefixes), (std::vector<CellRun>{{500, 1, 3}}));
}

}  // namespace
}  // namespace fanstream
