// Replays the sessions in protocol/*.txt against both machines. A line is "C> hex" (client to server), "S> hex" (server
// to client), or "# comment". FANSTREAM_UPDATE_GOLDEN=1 writes the files anew; look at the difference before committing
// it.
#include "tests/support/transcript.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "protocol/client_session.h"
#include "protocol/server_session.h"
#include "tests/support/synthetic_source.h"

namespace fanstream {
namespace {

using testing::Line;
using testing::read_transcript;

// The asset of the transcripts: bytes that a reader can recognise.
class TinySource final : public SegmentSource {
 public:
  Digest digest() const override {
    return {0xd1, 0xd2, 0xd3, 0xd4, 0xd5, 0xd6, 0xd7, 0xd8, 0xd9, 0xda, 0xdb, 0xdc, 0xdd, 0xde, 0xdf, 0xe0};
  }
  Bytes head() const override { return as_bytes("the head"); }
  Bytes index() const override { return as_bytes("the index"); }
  std::uint32_t cell_count() const override { return 3; }
  std::uint32_t segment_count(std::uint32_t cell) const override { return cell + 1; }
  Bytes segment(std::uint32_t cell, std::uint32_t segment) const override {
    static const char* const kText[3][3] = {{"c0s0"}, {"c1s0", "c1s1"}, {"c2s0", "", "c2s2"}};
    return as_bytes(kText[cell][segment]);
  }
  std::uint64_t vertex_count() const override { return 300; }
  std::uint64_t triangle_count() const override { return 596; }
  std::uint64_t size_bytes() const override { return 1000; }
};

// What the client's user does, by the event that makes him do it; in step with the transcripts below.
struct Scenario {
  const char* name;
  const char* what;
  std::function<void(ClientSession&, const ClientEvent*)> user;  // null event: at the start
  std::function<void(ServerSession&, const ServerEvent&)> provider;
  ClientSessionOptions client = {};
};

const std::vector<CellRun> kEverything = {{0, 3, kAllSegments}};

void serve_tiny(ServerSession& server, const ServerEvent& event) {
  if (std::holds_alternative<ListRequested>(event)) {
    CatalogueEntry ready{"tiny", ModelState::ready, 0, "", TinySource().digest(), 1000, 300, 596};
    server.send_catalogue(
        {ready, {"slow", ModelState::building, 250, ""}, {"bad", ModelState::failed, 0, "no triangles"}});
  } else if (std::get<OpenRequested>(event).model == "tiny") {
    server.open_building(0.5, 0);
    server.open_ready(std::make_shared<TinySource>());
  } else {
    server.open_failed(ErrorCode::unknown_model, "not here");
  }
}

template <class Event>
const Event* as(const ClientEvent* event) {
  return event != nullptr ? std::get_if<Event>(event) : nullptr;
}

std::vector<Scenario> scenarios() {
  ClientSessionOptions from_the_future;
  from_the_future.version_min = 3;
  from_the_future.version_max = 5;
  return {
      {"whole_model",
       "Catalogue, open, head, index, every segment.",
       [](ClientSession& client, const ClientEvent* event) {
         if (as<event::Welcomed>(event)) client.list();
         if (as<event::Catalogue>(event)) {
           EXPECT_TRUE(client.open("tiny"));
         }
         if (as<event::IndexComplete>(event)) {
           EXPECT_TRUE(client.set_wants(kEverything));
         }
       },
       serve_tiny,
       {}},
      {"levels_and_release",
       "Wants by level, then a cell is dropped and wanted again.",
       [](ClientSession& client, const ClientEvent* event) {
         if (as<event::Welcomed>(event)) {
           EXPECT_TRUE(client.open("tiny"));
         }
         if (as<event::IndexComplete>(event)) {
           EXPECT_TRUE(client.set_wants({{0, 3, 1}, {0, 3, 2}, {0, 3, 3}}));
         }
         const auto* served = as<event::WantsServed>(event);
         if (served == nullptr || served->epoch != 1) return;
         EXPECT_TRUE(client.release({{2, 1, 1}}));
         EXPECT_TRUE(client.set_wants({{2, 1, 3}}));
       },
       serve_tiny,
       {}},
      {"resume",
       "A client that holds the head, the index and half of the segments.",
       [](ClientSession& client, const ClientEvent* event) {
         const Have have{TinySource().digest(), true, true, {{0, 1, kAllSegments}, {1, 2, 1}}};
         if (as<event::Welcomed>(event)) {
           EXPECT_TRUE(client.open("tiny", have));
         }
         if (as<event::ModelOpened>(event)) {
           EXPECT_TRUE(client.set_wants(kEverything));
         }
       },
       serve_tiny,
       {}},
      {"release_under_way",
       "Cells are dropped while segments of theirs are under way.",
       [](ClientSession& client, const ClientEvent* event) {
         if (as<event::Welcomed>(event)) {
           EXPECT_TRUE(client.open("tiny"));
         }
         if (as<event::IndexComplete>(event)) {
           EXPECT_TRUE(client.set_wants({{1, 2, kAllSegments}}));
         }
         const auto* arrived = as<event::SegmentArrived>(event);
         if (arrived == nullptr || arrived->cell != 1 || arrived->segment != 0 || client.set_epoch() != 1) return;
         EXPECT_TRUE(client.release({{1, 1, 0}}));
         EXPECT_TRUE(client.set_wants({{1, 1, kAllSegments}}));
       },
       serve_tiny,
       {}},
      {"refusals",
       "A model that is not there, then wants beyond the last cell.",
       [](ClientSession& client, const ClientEvent* event) {
         if (as<event::Welcomed>(event)) {
           EXPECT_TRUE(client.open("nowhere"));
         }
         const auto* refused = as<event::Refused>(event);
         if (refused != nullptr && refused->code == ErrorCode::unknown_model) {
           EXPECT_TRUE(client.open("tiny"));
         }
         if (as<event::IndexComplete>(event)) {
           EXPECT_TRUE(client.set_wants({{2, 2, 1}}));
         }
       },
       serve_tiny,
       {}},
      {"version_mismatch", "A client of versions 3 to 5.", [](ClientSession&, const ClientEvent*) {}, serve_tiny,
       from_the_future},
  };
}

std::string path_of(const Scenario& scenario) {
  return std::string(FANSTREAM_SOURCE_DIR) + "/tests/golden/protocol/" + scenario.name + ".txt";
}

std::string hex(Bytes bytes) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const std::byte byte : bytes) {
    text += kDigits[std::to_integer<unsigned>(byte) >> 4];
    text += kDigits[std::to_integer<unsigned>(byte) & 15U];
  }
  return text;
}

// One frame a line, so that a difference names its frame.
void add_frames(char side, Bytes bytes, std::vector<Line>& lines) {
  while (!bytes.empty()) {
    const std::size_t size =
        kFrameHeaderBytes + (std::to_integer<std::size_t>(bytes[1]) | std::to_integer<std::size_t>(bytes[2]) << 8);
    ASSERT_LE(size, bytes.size());
    lines.push_back({side, {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)}});
    bytes = bytes.subspan(size);
  }
}

void take_client_output(ClientSession& client, std::vector<Line>& lines) {
  for (Bytes output = client.pending_output(); !output.empty(); output = client.pending_output()) {
    add_frames('C', output, lines);
    client.written(output.size());
  }
}

void take_server_output(ServerSession& server, std::vector<Line>& lines) {
  std::array<Bytes, 64> buffers;
  std::vector<std::byte> scratch;
  while (server.wants_to_send()) {
    std::vector<std::byte> bytes;
    for (const Bytes& buffer : std::span(buffers).first(server.next_write(buffers, scratch))) {
      bytes.insert(bytes.end(), buffer.begin(), buffer.end());
    }
    if (bytes.empty()) return;
    add_frames('S', bytes, lines);
    server.written(bytes.size(), 0);
  }
}

void client_turn(const Scenario& scenario, ClientSession& client) {
  while (const std::optional<ClientEvent> event = client.next_event()) {
    const auto* opened = as<event::ModelOpened>(&*event);
    if (as<event::IndexComplete>(&*event) || (opened != nullptr && opened->model.resumed)) {
      EXPECT_TRUE(client.set_segment_table(segment_table(TinySource())));
    }
    scenario.user(client, &*event);
  }
}

void server_turn(const Scenario& scenario, ServerSession& server) {
  while (const std::optional<ServerEvent> event = server.next_event(0)) scenario.provider(server, *event);
}

std::vector<Line> perform(const Scenario& scenario) {
  ServerSession server({}, 0);
  ClientSession client(scenario.client, 0);
  std::vector<Line> lines;
  for (std::size_t seen = ~std::size_t{0}; seen != lines.size();) {
    seen = lines.size();
    std::vector<Line> said;
    take_client_output(client, said);
    for (const Line& line : said) server.receive(line.bytes, 0);
    lines.insert(lines.end(), said.begin(), said.end());
    server_turn(scenario, server);
    said.clear();
    take_server_output(server, said);
    for (const Line& line : said) client.receive(line.bytes, 0);
    lines.insert(lines.end(), said.begin(), said.end());
    client_turn(scenario, client);
  }
  return lines;
}

std::vector<Line> only(char side, const std::vector<Line>& lines) {
  std::vector<Line> found;
  for (const Line& line : lines) {
    if (line.side == side) found.push_back(line);
  }
  return found;
}

TEST(GoldenTranscript, ServerSaysWhatItAlwaysSaid) {
  for (const Scenario& scenario : scenarios()) {
    SCOPED_TRACE(scenario.name);
    const std::vector<Line> golden = read_transcript(path_of(scenario));
    ASSERT_FALSE(golden.empty());
    ServerSession server({}, 0);
    std::vector<Line> said;
    for (std::size_t i = 0; i < golden.size(); ++i) {
      if (golden[i].side != 'C') continue;
      server.receive(golden[i].bytes, 0);
      server_turn(scenario, server);
      if (i + 1 < golden.size() && golden[i + 1].side == 'C') continue;
      take_server_output(server, said);
    }
    EXPECT_EQ(said, only('S', golden));
  }
}

TEST(GoldenTranscript, ClientSaysWhatItAlwaysSaid) {
  for (const Scenario& scenario : scenarios()) {
    SCOPED_TRACE(scenario.name);
    const std::vector<Line> golden = read_transcript(path_of(scenario));
    ClientSession client(scenario.client, 0);
    std::vector<Line> said;
    take_client_output(client, said);
    for (const Line& line : golden) {
      if (line.side != 'S') continue;
      client.receive(line.bytes, 0);
      client_turn(scenario, client);
      take_client_output(client, said);
    }
    EXPECT_EQ(said, only('C', golden));
  }
}

TEST(GoldenTranscript, FilesAreWhatTheMachinesSayToEachOther) {
  const bool update = std::getenv("FANSTREAM_UPDATE_GOLDEN") != nullptr;
  for (const Scenario& scenario : scenarios()) {
    SCOPED_TRACE(scenario.name);
    const std::vector<Line> lines = perform(scenario);
    if (update) {
      std::ofstream file(path_of(scenario));
      file << "# " << scenario.what << " One frame a line; layouts in protocol/PROTOCOL.md.\n";
      for (const Line& line : lines) {
        file << "# " << name(static_cast<FrameType>(line.bytes[0])) << "\n"
             << line.side << "> " << hex(line.bytes) << "\n";
      }
    }
    EXPECT_EQ(lines, read_transcript(path_of(scenario)));
  }
}

}  // namespace
}  // namespace fanstream
