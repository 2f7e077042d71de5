// The client connection against servers that are absent, silent, strange or lying.
#include "client/net/stream_client.h"

#include <gtest/gtest.h>

#include <thread>

#include "protocol/frame.h"
#include "tests/support/raw_socket.h"

namespace fanstream {
namespace {

// Accepts one client, says these bytes, and closes or stays silent until the client has gone.
class ScriptedServer {
 public:
  ScriptedServer(std::vector<std::byte> script, bool then_close)
      : thread_([this, script = std::move(script), then_close] {
          RawSocket socket = listener_.accept();
          socket.send(script);
          if (then_close) {
            socket.half_close();
          }
          socket.receive_all();
        }) {}
  ~ScriptedServer() { thread_.join(); }
  ServerAddress address() const { return {"127.0.0.1", listener_.port(), ""}; }

 private:
  RawListener listener_;
  std::thread thread_;
};

std::vector<std::byte> bytes_of(std::string_view text) {
  const Bytes view = as_bytes(text);
  return {view.begin(), view.end()};
}

void expect_message(const Error& error, const std::string& text) {
  EXPECT_NE(error.message.find(text), std::string::npos) << error.message;
}

TEST(StreamClient, ARefusedConnectionNamesHostAndPort) {
  std::uint16_t port = 0;
  {
    const RawListener listener;
    port = listener.port();
  }
  const auto client = StreamClient::connect({"127.0.0.1", port, ""});
  ASSERT_FALSE(client);
  EXPECT_EQ(client.error().kind, ErrorKind::network);
  expect_message(client.error(), "127.0.0.1:" + std::to_string(port));
  expect_message(client.error(), "refused");
}

TEST(StreamClient, AnUnknownHostIsNamed) {
  const auto client = StreamClient::connect({"no-such-host.invalid", 1, ""});
  ASSERT_FALSE(client);
  expect_message(client.error(), "unknown host 'no-such-host.invalid'");
}

TEST(StreamClient, ASilentServerIsGivenUp) {
  const ScriptedServer server({}, false);
  StreamClientOptions options;
  options.connect_timeout_ms = 200;
  const auto client = StreamClient::connect(server.address(), options);
  ASSERT_FALSE(client);
  expect_message(client.error(), "no welcome");
}

TEST(StreamClient, TheStopFlagEndsEveryWait) {
  const ScriptedServer server({}, false);
  const std::atomic<bool> stop{true};
  StreamClientOptions options;
  options.stop = &stop;
  const auto client = StreamClient::connect(server.address(), options);
  ASSERT_FALSE(client);
  EXPECT_EQ(client.error().kind, ErrorKind::interrupted);
}

TEST(StreamClient, AnotherKindOfServerIsNoticed) {
  for (const char* greeting : {"HTTP/1.1 400 Bad Request\r\n\r\n", "SSH-2.0-OpenSSH_9.2\r\n", "\x81\x0c"}) {
    const ScriptedServer server(bytes_of(greeting), true);
    const auto client = StreamClient::connect(server.address());
    ASSERT_FALSE(client);
  }
}

TEST(StreamClient, AServerThatEndsInTheMiddleOfAFrameIsNamedWithTheBytesReceived) {
  std::vector<std::byte> script;
  encode(Welcome{}, script);
  encode(Opened{}, script);
  script = std::vector<std::byte>(script.begin(), script.end() - 5);
  const ScriptedServer server(script, true);
  auto client = StreamClient::connect(server.address());
  ASSERT_TRUE(client) << client.error().message;
  const auto opened = client->open("model");
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().kind, ErrorKind::network);
  expect_message(opened.error(), "after " + std::to_string(script.size()) + " bytes");
  expect_message(opened.error(), "middle of a frame");
  expect_message(opened.error(), server.address().text());
}

TEST(StreamClient, AStallIsNamedWithWhatWasAwaited) {
  std::vector<std::byte> script;
  encode(Welcome{}, script);
  Opened opened;
  opened.head_size_bytes = 1000;
  encode(opened, script);
  const ScriptedServer server(script, false);
  StreamClientOptions options;
  options.session.stall_timeout_ms = 300;
  auto client = StreamClient::connect(server.address(), options);
  ASSERT_TRUE(client);
  ASSERT_TRUE(client->open("model"));
  const auto head = client->receive_head();
  ASSERT_FALSE(head);
  expect_message(head.error(), "the model's head");
}

TEST(StreamClient, LiesOfTheServerAreRefused) {
  const auto data = [](FrameType type, std::vector<std::uint32_t> fields, std::size_t size,
                       std::vector<std::byte>& out) {
    const std::vector<std::byte> blob(size);
    const DataFrameHeader header(type, fields, blob);
    out.insert(out.end(), header.bytes().begin(), header.bytes().end());
    out.insert(out.end(), blob.begin(), blob.end());
  };
  Opened model;
  model.cell_count = 10;
  model.head_size_bytes = 100;
  using Script = std::vector<std::byte>;
  const std::vector<std::function<void(Script&)>> lies = {
      [&](Script& s) { data(FrameType::head_data, {0}, 101, s); },  // more than announced
      [&](Script& s) { data(FrameType::head_data, {50}, 50, s); },  // a hole
      [&](Script& s) {
        data(FrameType::head_data, {0}, 100, s), data(FrameType::segments, {0, 1, 0}, 5, s);
      },  // unwanted
      [&](Script& s) {
        encode(WantsDone{4, 0}, s);
      },
      [&](Script& s) { encode(Opened{}, s); },
      [&](Script& s) { encode(Welcome{}, s); },
      [&](Script& s) { encode_catalogue({}, s); },
      [&](Script& s) { encode(Hello{}, s); },
  };
  for (std::size_t i = 0; i < lies.size(); ++i) {
    SCOPED_TRACE(i);
    Script script;
    encode(Welcome{}, script);
    encode(model, script);
    lies[i](script);
    const ScriptedServer server(script, false);
    auto client = StreamClient::connect(server.address());
    ASSERT_TRUE(client);
    ASSERT_TRUE(client->open("model"));
    Result<std::optional<ClientEvent>> event = client->next_event(10'000);
    ASSERT_FALSE(event);
    EXPECT_EQ(event.error().kind, ErrorKind::bad_input) << event.error().message;
  }
}

TEST(StreamClient, DataBeyondTheCreditIsRefused) {
  ClientSessionOptions options;
  options.window_bytes = 2 * kMaxChunkBytes;
  ClientSession session(options, 0);
  std::vector<std::byte> script;
  encode(Welcome{}, script);
  session.receive(script, 0);
  ASSERT_TRUE(session.next_event());
  ASSERT_TRUE(session.open("model"));
  session.written(session.pending_output().size());
  script.clear();
  Opened model;
  model.head_size_bytes = 4 * kMaxChunkBytes;
  encode(model, script);
  session.receive(script, 0);
  ASSERT_TRUE(session.next_event());
  const std::vector<std::byte> blob(kMaxChunkBytes);
  for (std::uint32_t i = 0; i < 3; ++i) {  // the third comes before any further credit has left the client
    EXPECT_FALSE(session.failed()) << i;
    const std::array<std::uint32_t, 1> fields{i * static_cast<std::uint32_t>(kMaxChunkBytes)};
    session.receive(DataFrameHeader(FrameType::head_data, fields, blob).bytes(), 0);
    session.receive(blob, 0);
    while (const auto event = session.next_event()) {
      if (const auto* failed = std::get_if<event::Failed>(&*event)) expect_message(failed->error, "beyond the credit");
    }
  }
  EXPECT_TRUE(session.failed());
}

TEST(ServerAddress, EveryFormIsRead) {
  const auto full = parse_server_address("example.org:7000/bunny");
  ASSERT_TRUE(full);
  EXPECT_EQ(full->host, "example.org");
  EXPECT_EQ(full->port, 7000);
  EXPECT_EQ(full->model, "bunny");
  EXPECT_EQ(parse_server_address("localhost/a/b")->model, "a/b");
  EXPECT_EQ(parse_server_address("localhost")->port, kDefaultPort);
  EXPECT_EQ(parse_server_address("[::1]:80/x")->host, "::1");
  EXPECT_EQ(parse_server_address("[::1]:80/x")->text(), "[::1]:80");
  for (const char* wrong : {"", ":80", "host:", "host:0", "host:65536", "host:8x", "[::1", "host/", "[::1]x"}) {
    const auto address = parse_server_address(wrong);
    EXPECT_FALSE(address) << wrong;
  }
}

}  // namespace
}  // namespace fanstream
