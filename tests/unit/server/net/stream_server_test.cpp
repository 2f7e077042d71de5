// The server and the client connection over real loopback sockets.
#include "server/net/stream_server.h"

#include <gtest/gtest.h>

#include <random>
#include <thread>

#include "client/load/load_run.h"
#include "client/net/stream_client.h"
#include "tests/support/raw_socket.h"
#include "tests/support/synthetic_source.h"

namespace fanstream {
namespace {

class StreamServerTest : public testing::Test {
 protected:
  void serve(const SyntheticShape& shape = {}, ServerOptions options = {}) {
    source = std::make_shared<SyntheticSource>(shape);
    provider->set_ready("model", source);
    options.host = "127.0.0.1";
    options.port = 0;
    options.building_poll_ms = 10;
    auto started = StreamServer::start(options, provider);
    ASSERT_TRUE(started) << started.error().message;
    server = std::move(*started);
  }

  ServerAddress address() const { return {"127.0.0.1", server->port(), "model"}; }
  std::vector<CellRun> everything() const { return {{0, source->cell_count(), kAllSegments}}; }

  Result<StreamClient> open(std::optional<Have> have = {}, const StreamClientOptions& options = {}) const {
    Result<StreamClient> client = StreamClient::connect(address(), options);
    if (!client) return client;
    const Result<Opened> opened = client->open("model", {}, std::move(have));
    if (!opened) return tl::unexpected<Error>(opened.error());
    const Result<Bytes> index = client->receive_index();
    if (!index) return tl::unexpected<Error>(index.error());
    if (const auto set = client->set_segment_table(source->table()); !set) return tl::unexpected<Error>(set.error());
    return client;
  }

  LoadOptions load_of(std::uint32_t clients) const {
    LoadOptions options;
    options.address = address();
    options.clients = clients;
    options.read_table = [this](Bytes, Bytes) -> Result<std::shared_ptr<const SegmentTable>> {
      return source->table();
    };
    return options;
  }

  // Fetches the whole model and compares every byte.
  void expect_exact() const {
    Result<StreamClient> client = open();
    ASSERT_TRUE(client) << client.error().message;
    const Result<Bytes> head = client->receive_head();
    ASSERT_TRUE(head) << head.error().message;
    EXPECT_TRUE(std::ranges::equal(*head, source->head()));
    const Result<Bytes> index = client->receive_index();
    ASSERT_TRUE(index) << index.error().message;
    EXPECT_TRUE(std::ranges::equal(*index, source->index()));
    ASSERT_TRUE(client->set_wants(everything()));
    ReceivedModel received(*source);
    const auto failed = receive(*client, received);
    ASSERT_FALSE(failed) << failed->message;
    EXPECT_TRUE(received.complete());
  }

  void wait_until_all_have_gone() const {
    for (int i = 0; i < 1000 && server->metrics().sessions_open > 0; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }

  // Until the newest list is served, at most max_segments, or an error.
  static std::optional<Error> receive(StreamClient& client, ReceivedModel& received,
                                      std::uint64_t max_segments = ~0ULL) {
    while (client.session().wants_outstanding() && received.segments() < max_segments) {
      const Result<std::optional<ClientEvent>> event = client.next_event(20'000);
      if (!event) return event.error();
      if (!*event) return Error{ErrorKind::network, "silence"};
      if (const auto* segment = std::get_if<event::SegmentArrived>(&**event)) {
        EXPECT_TRUE(received.add(segment->cell, segment->segment, segment->bytes));
      }
    }
    return std::nullopt;
  }

  std::shared_ptr<SyntheticProvider> provider = std::make_shared<SyntheticProvider>();
  std::shared_ptr<SyntheticSource> source;
  std::unique_ptr<StreamServer> server;
};

TEST_F(StreamServerTest, AClientReceivesTheModelExactly) {
  serve();
  expect_exact();
  serve({2, 30, 3, 300'000, 500'000, 200'000});  // parts, and more than the credit window
  expect_exact();
}

TEST_F(StreamServerTest, TwoHundredClientsAtOnceAllReceiveTheModelExactly) {
  serve({3, 300, 6, 700, 5000, 20'000});
  const LoadReport report = run_load(load_of(200));
  EXPECT_EQ(report.complete, 200U) << (report.first_failure ? report.first_failure->message : "");
  EXPECT_EQ(report.distinct_contents, 1U);
  EXPECT_EQ(report.segments, 200 * source->nonempty_total());
  expect_exact();
  wait_until_all_have_gone();  // then everything is counted
  EXPECT_EQ(server->metrics().sessions_total, 201U);
  EXPECT_EQ(server->metrics().sent_segments, 201 * source->nonempty_total());
  EXPECT_EQ(server->metrics().sessions_failed, 0U);
}

TEST_F(StreamServerTest, ListNamesEveryModelWithItsState) {
  serve();
  provider->set("half", {ModelStatus::State::building, 0.5, "", nullptr});
  provider->set("broken", {ModelStatus::State::failed, 0, "no triangles", nullptr});
  Result<StreamClient> client = StreamClient::connect(address());
  ASSERT_TRUE(client) << client.error().message;
  for (int i = 0; i < 3; ++i) {
    const auto entries = client->list();
    ASSERT_TRUE(entries) << entries.error().message;
    EXPECT_EQ(*entries, provider->catalogue());
  }
}

TEST_F(StreamServerTest, OpenWaitsWhileTheModelIsBuilt) {
  serve();
  provider->set("late", {ModelStatus::State::building, 0, "", nullptr});
  Result<StreamClient> client = StreamClient::connect(address());
  ASSERT_TRUE(client);
  std::vector<double> fractions;
  const Result<Opened> opened = client->open("late", [&](double fraction) {
    fractions.push_back(fraction);
    if (fraction < 0.75) {
      provider->set("late", {ModelStatus::State::building, fraction + 0.25, "", nullptr});
    } else {
      provider->set_ready("late", source);
    }
  });
  ASSERT_TRUE(opened) << opened.error().message;
  EXPECT_EQ(fractions, (std::vector{0.0, 0.25, 0.5, 0.75}));
  EXPECT_EQ(opened->digest, source->digest());
}

TEST_F(StreamServerTest, UnknownAndFailedModelsAreNamedAndTheConnectionGoesOn) {
  serve();
  provider->set("broken", {ModelStatus::State::failed, 0, "no triangles in it", nullptr});
  Result<StreamClient> client = StreamClient::connect(address());
  ASSERT_TRUE(client);
  const auto unknown = client->open("missing");
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().kind, ErrorKind::not_found);
  EXPECT_NE(unknown.error().message.find("missing"), std::string::npos);
  EXPECT_NE(unknown.error().message.find(address().text()), std::string::npos);
  const auto broken = client->open("broken");
  ASSERT_FALSE(broken);
  EXPECT_NE(broken.error().message.find("no triangles in it"), std::string::npos);
  EXPECT_TRUE(client->open("model"));
}

TEST_F(StreamServerTest, ResumeOverANewConnectionFetchesOnlyTheRest) {
  serve({4, 200, 5, 3000});
  ReceivedModel received(*source);
  {
    Result<StreamClient> client = open();
    ASSERT_TRUE(client);
    ASSERT_TRUE(client->set_wants(everything()));
    ASSERT_FALSE(receive(*client, received, source->nonempty_total() / 2));
  }
  const std::uint64_t first_half = received.segments();
  Have have{source->digest(), true, true, {}};
  std::vector<CellPrefix> held;
  for (std::uint32_t cell = 0; cell < source->cell_count(); ++cell) held.push_back({cell, received.held(cell)});
  have.cells = to_runs(held);
  Result<StreamClient> client = open(have);
  ASSERT_TRUE(client) << client.error().message;
  EXPECT_TRUE(client->session().model()->resumed);
  ASSERT_TRUE(client->set_wants(everything()));
  ASSERT_FALSE(receive(*client, received));
  EXPECT_TRUE(received.complete());
  EXPECT_EQ(client->session().received_segments(), source->nonempty_total() - first_half);
}

TEST_F(StreamServerTest, AReplacedListStopsTheOldOne) {
  serve({5, 4000, 4, 20'000});  // about 80 MB
  StreamClientOptions options;
  options.session.window_bytes = 2 * kMaxChunkBytes;  // bounds what is under way
  Result<StreamClient> client = open({}, options);
  ASSERT_TRUE(client);
  ASSERT_TRUE(client->set_wants({{0, 3999, kAllSegments}}));
  ReceivedModel received(*source);
  ASSERT_FALSE(receive(*client, received, 100));
  ASSERT_TRUE(client->set_wants({{3999, 1, kAllSegments}}));
  ASSERT_FALSE(receive(*client, received));
  EXPECT_EQ(received.held(3999), source->segment_count(3999));
  EXPECT_LT(received.segments(), 400U);  // of some 8000
}

TEST_F(StreamServerTest, AStalledClientDoesNotStopOthers) {
  ServerOptions options;
  options.threads = 1;
  serve({6, 2000, 4, 20'000}, options);
  std::vector<RawSocket> stalled;
  std::vector<std::byte> request;
  encode(Hello{}, request);
  encode(Credit{kMaxCredit}, request);
  encode(Open{"model", {}}, request);
  encode(Wants{1, everything()}, request);
  for (int i = 0; i < 20; ++i) {
    stalled.push_back(RawSocket::connect(server->port()));
    ASSERT_TRUE(stalled.back().send(request));
  }
  expect_exact();
  expect_exact();
}

TEST_F(StreamServerTest, RandomBytesEndOnlyTheirOwnSession) {
  serve();
  for (std::uint32_t seed = 0; seed < 100; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::vector<std::byte> bytes;
    if (seed % 2 == 1) encode(Hello{}, bytes);
    if (seed % 4 == 3) encode(Open{"model", {}}, bytes);
    for (std::uint32_t i = 0; i < 2 + random() % 3000; ++i) bytes.push_back(static_cast<std::byte>(random()));
    RawSocket socket = RawSocket::connect(server->port());
    socket.send(bytes);
    if (seed % 5 == 0) {
      socket.reset();
      continue;
    }
    socket.half_close();
    socket.receive_all();
    EXPECT_TRUE(socket.ended());
  }
  expect_exact();
}

TEST_F(StreamServerTest, AnHttpRequestIsToldWhatItTalksTo) {
  serve();
  RawSocket socket = RawSocket::connect(server->port());
  socket.send(as_bytes("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"));
  const std::vector<std::byte> answer = socket.receive_all();
  EXPECT_TRUE(socket.ended());
  const std::string text(reinterpret_cast<const char*>(answer.data()), answer.size());
  EXPECT_NE(text.find("Fanstream"), std::string::npos);
}

TEST_F(StreamServerTest, ClientsThatSayNothingOrTooSlowlyAreEnded) {
  ServerOptions options;
  options.session.handshake_timeout_ms = 100;
  options.session.frame_timeout_ms = 100;
  serve({}, options);
  RawSocket silent = RawSocket::connect(server->port());
  RawSocket slow = RawSocket::connect(server->port());
  std::vector<std::byte> begun;
  encode(Hello{}, begun);
  encode(Open{"model", {}}, begun);
  begun.pop_back();
  slow.send(begun);
  silent.receive_all();
  slow.receive_all();
  EXPECT_TRUE(silent.ended());
  EXPECT_TRUE(slow.ended());
  expect_exact();
}

TEST_F(StreamServerTest, ClientsThatVanishMidStreamLeaveNothingBehind) {
  serve({7, 1000, 4, 20'000});
  std::vector<std::byte> request;
  encode(Hello{}, request);
  encode(Credit{kMaxCredit}, request);
  encode(Open{"model", {}}, request);
  encode(Wants{1, everything()}, request);
  for (int i = 0; i < 50; ++i) {
    RawSocket socket = RawSocket::connect(server->port());
    ASSERT_TRUE(socket.send(request));
    socket.receive_some(static_cast<std::size_t>(1000 * i));
    if (i % 2 == 0) {
      socket.reset();
    } else {
      socket.close();
    }
  }
  expect_exact();
  wait_until_all_have_gone();
  EXPECT_EQ(server->metrics().sessions_open, 0U);
}

TEST_F(StreamServerTest, AFloodOfListRequestsIsNoFloodOfCatalogues) {
  serve();
  for (int i = 0; i < 500; ++i)
    provider->set("another-model-" + std::to_string(i), {ModelStatus::State::failed, 0, "broken", nullptr});
  constexpr int kLists = 4000;
  std::vector<std::byte> request;
  encode(Hello{}, request);
  for (int i = 0; i < kLists; ++i) write_frame(FrameType::list, {}, request);
  encode(FrameType::ping, Ping{5}, request);
  RawSocket socket = RawSocket::connect(server->port());
  ASSERT_TRUE(socket.send(request));
  FrameReader reader(Receiver::client);
  int catalogues = 0;
  for (bool answered = false; !answered;) {
    const std::vector<std::byte> bytes = socket.receive_next();
    ASSERT_FALSE(bytes.empty());
    reader.push(bytes);
    for (auto frame = reader.next(); frame && *frame; frame = reader.next()) {
      if ((*frame)->type == FrameType::catalogue) ++catalogues;
      answered = answered || (*frame)->type == FrameType::pong;
    }
  }
  EXPECT_GT(catalogues, 0);
  EXPECT_LT(catalogues, kLists / 20) << "what the server reads at once is answered at once";
}

TEST_F(StreamServerTest, AFloodOfWantsIsServedByItsLastList) {
  serve({8, 1000, 3, 300});
  std::vector<std::byte> request;
  encode(Hello{}, request);
  encode(Credit{kMaxCredit}, request);
  encode(Open{"model", {}}, request);
  for (std::uint32_t epoch = 1; epoch <= 50'000; ++epoch) encode(Wants{epoch, everything()}, request);
  RawSocket socket = RawSocket::connect(server->port());
  std::thread sender([&] { socket.send(request); });
  FrameReader reader(Receiver::client);
  std::uint64_t segments = 0;
  std::uint32_t served = 0;
  while (served < 50'000) {
    const std::vector<std::byte> bytes = socket.receive_some(1);
    if (bytes.empty()) break;
    reader.push(bytes);
    for (auto frame = reader.next(); frame && *frame; frame = reader.next()) {
      if ((*frame)->type == FrameType::segments) {
        const Result<SegmentBatch> batch = decode_segments((*frame)->payload);
        ASSERT_TRUE(batch);
        for (const BatchRun& run : batch->runs) segments += run.cell_count * run.segment_count;
      }
      if ((*frame)->type == FrameType::wants_done) served = decode_wants_done((*frame)->payload)->epoch;
    }
  }
  sender.join();
  EXPECT_EQ(served, 50'000U);
  EXPECT_EQ(segments, source->nonempty_total());
}

TEST_F(StreamServerTest, VersionMismatchIsNamedOnTheClient) {
  serve();
  StreamClientOptions options;
  options.session.version_min = options.session.version_max = 9;
  const auto client = StreamClient::connect(address(), options);
  ASSERT_FALSE(client);
  EXPECT_EQ(client.error().kind, ErrorKind::unsupported);
  EXPECT_NE(client.error().message.find("version 2, the client 9"), std::string::npos) << client.error().message;
}

TEST_F(StreamServerTest, APortInUseIsNamedWithWhatToDo) {
  serve();
  ServerOptions options;
  options.host = "127.0.0.1";
  options.port = server->port();
  const auto second = StreamServer::start(options, provider);
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().message.find(std::to_string(server->port()) + " is in use"), std::string::npos);
  EXPECT_NE(second.error().message.find("--port"), std::string::npos);
}

TEST_F(StreamServerTest, AnAddressThatIsNotOursIsNamed) {
  ServerOptions options;
  options.host = "192.0.2.1";
  options.port = 0;
  const auto started = StreamServer::start(options, provider);
  ASSERT_FALSE(started);
  EXPECT_NE(started.error().message.find("192.0.2.1"), std::string::npos);
}

TEST_F(StreamServerTest, AFullServerSaysSo) {
  ServerOptions options;
  options.max_sessions = 2;
  serve({}, options);
  const auto first = open();
  const auto second = open();
  ASSERT_TRUE(first && second);
  const auto third = StreamClient::connect(address());
  ASSERT_FALSE(third);
  EXPECT_EQ(third.error().kind, ErrorKind::limit);
  EXPECT_NE(third.error().message.find("server full"), std::string::npos);
}

TEST_F(StreamServerTest, StopTellsClientsInTheMiddleAndFreesThePort) {
  serve({9, 4000, 4, 20'000});
  StreamClientOptions options;
  options.session.window_bytes = 2 * kMaxChunkBytes;
  Result<StreamClient> client = open({}, options);
  ASSERT_TRUE(client);
  ASSERT_TRUE(client->set_wants(everything()));
  ReceivedModel received(*source);
  ASSERT_FALSE(receive(*client, received, 50));
  std::thread stopping([&] { server->stop(); });
  const std::optional<Error> end = receive(*client, received);
  stopping.join();
  ASSERT_TRUE(end);
  EXPECT_EQ(end->kind, ErrorKind::network);
  EXPECT_NE(end->message.find("shutting down"), std::string::npos) << end->message;
  EXPECT_GE(received.segments(), 50U);  // what was received stays
  ServerOptions again;
  again.host = "127.0.0.1";
  again.port = server->port();
  EXPECT_TRUE(StreamServer::start(again, provider));
}

TEST_F(StreamServerTest, AServerThatDiesMidStreamIsAnErrorWithWhatWasReceived) {
  ServerOptions options;
  options.drain_timeout_ms = 0;
  serve({10, 4000, 4, 20'000}, options);
  StreamClientOptions client_options;
  client_options.session.window_bytes = 2 * kMaxChunkBytes;
  Result<StreamClient> client = open({}, client_options);
  ASSERT_TRUE(client);
  ASSERT_TRUE(client->set_wants(everything()));
  ReceivedModel received(*source);
  ASSERT_FALSE(receive(*client, received, 50));
  const std::string text = address().text();
  server.reset();
  const std::optional<Error> end = receive(*client, received);
  ASSERT_TRUE(end);
  EXPECT_EQ(end->kind, ErrorKind::network);
  EXPECT_NE(end->message.find(text), std::string::npos);
  EXPECT_GE(client->session().received_segments(), 50U);
  EXPECT_TRUE(std::ranges::equal(client->session().head(), source->head()));
}

TEST_F(StreamServerTest, StopWithManyClientsInTheMiddleEnds) {
  serve({11, 2000, 4, 20'000});
  std::thread stopping([&] {
    while (server->metrics().sent_segments < 100) std::this_thread::yield();
    server->stop();
  });
  const LoadReport report = run_load(load_of(50));
  stopping.join();
  std::uint32_t failed = 0;
  for (const auto& [message, count] : report.failures) failed += count;
  EXPECT_EQ(report.complete + failed, 50U);
  EXPECT_GT(failed, 0U);
}

}  // namespace
}  // namespace fanstream
