// Many small segments in a frame: what it costs, what is refused, and that nothing of it is guessed wrong.
#include <gtest/gtest.h>

#include <random>

#include "tests/unit/protocol/session_pair.h"

namespace fanstream {
namespace {

std::vector<CellRun> everything(const SegmentSource& source) { return {{0, source.cell_count(), kAllSegments}}; }

// Cells as an asset has them: one segment a generation, a few dozen bytes.
SyntheticShape small_segments(std::uint32_t seed) { return {seed, 2000, 12, 60, 100, 100, 4}; }

std::uint64_t segment_bytes(const SyntheticSource& source) {
  return source.size_bytes() - source.head().size() - source.index().size();
}

TEST(SegmentBatch, SmallSegmentsCostAFewBytesEach) {
  const auto source = std::make_shared<SyntheticSource>(small_segments(1));
  std::vector<CellPrefix> scattered;
  for (std::uint32_t i = 0; i < 2000; ++i) scattered.push_back({i * 7919 % 2000, kAllSegments});
  std::vector<CellRun> levels;
  for (std::uint32_t prefix = 1; prefix <= 12; ++prefix) levels.push_back({0, 2000, prefix});
  std::vector<CellPrefix> scattered_levels;
  for (std::uint32_t prefix = 1; prefix <= 12; ++prefix) {
    for (std::uint32_t i = 0; i < 2000; ++i) scattered_levels.push_back({i * 7919 % 2000, prefix});
  }
  const std::pair<std::vector<CellRun>, double> lists[] = {
      {everything(*source), 1.0}, {levels, 2.2}, {to_runs(scattered), 1.0}, {to_runs(scattered_levels), 2.4}};
  for (const auto& [list, most] : lists) {
    SessionPair pair;
    pair.open(source);
    pair.run();
    const std::uint64_t before = pair.client.received_bytes();
    ASSERT_TRUE(pair.client.set_wants(list));
    pair.run();
    ASSERT_EQ(pair.arrived_cells.size(), source->nonempty_total());
    const std::uint64_t wire = pair.client.received_bytes() - before;
    EXPECT_LE(static_cast<double>(wire - segment_bytes(*source)) / static_cast<double>(source->nonempty_total()), most);
  }
}

TEST(SegmentBatch, FramesAreSmallSoThatTheirFirstSegmentIsSoonOfUse) {
  const auto source = std::make_shared<SyntheticSource>(small_segments(2));
  SessionPair pair;
  pair.open(source);
  pair.run();
  ASSERT_TRUE(pair.client.set_wants(everything(*source)));
  pair.client_to_server();
  std::size_t most = 0, unseen = 0;
  while (pair.server_to_client(97) > 0) {  // dribbles
    unseen += 97;
    const std::size_t before = pair.arrived_cells.size();
    pair.take_events();
    if (pair.arrived_cells.size() > before) unseen = 0;
    most = std::max(most, unseen);
    pair.client_to_server();
  }
  EXPECT_EQ(pair.arrived_cells.size(), source->nonempty_total());
  EXPECT_LE(most, kBatchBytes + 4 * 97 + 500);
}

// However often lists are replaced, whatever was written of the old ones: every segment once.
TEST(SegmentBatch, ReplacedListsLoseAndRepeatNothing) {
  for (std::uint32_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    SyntheticShape shape = small_segments(seed);
    shape.cells = 300;
    if (seed % 3 == 0) shape.max_segment_bytes = 6000;
    if (seed % 10 == 0) shape.max_segment_bytes = 150'000, shape.cells = 12;
    const auto source = std::make_shared<SyntheticSource>(shape);
    ClientSessionOptions options;
    options.window_bytes = 2 * kMaxChunkBytes;
    SessionPair pair({}, options);
    ReceivedModel received(*source);
    pair.on_segment = [&](const event::SegmentArrived& s) { EXPECT_TRUE(received.add(s.cell, s.segment, s.bytes)); };
    pair.open(source);
    pair.run();
    for (int round = 0; round < 30; ++round) {
      std::vector<CellPrefix> list;
      for (std::uint32_t i = 0; i < 1 + random() % 40; ++i) {
        list.push_back({static_cast<std::uint32_t>(random() % shape.cells),
                        static_cast<std::uint32_t>(random() % (shape.max_segments + 2))});
      }
      ASSERT_TRUE(pair.client.set_wants(to_runs(list)));
      pair.client_to_server();
      pair.server_to_client(random() % 5000);
      if (random() % 2 == 0) pair.take_events();
    }
    ASSERT_TRUE(pair.client.set_wants(everything(*source)));
    pair.run();
    EXPECT_TRUE(received.complete());
    EXPECT_EQ(received.segments(), source->nonempty_total());
    EXPECT_EQ(pair.last<event::Failed>(), nullptr);
  }
}

// Releases cross segments under way, several at a time; what is held is exactly what was given out and not released.
TEST(SegmentBatch, ReleasesThatCrossSegmentsUnderWayAreTold) {
  std::uint64_t stale = 0;
  for (std::uint32_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    SyntheticShape shape = small_segments(seed);
    shape.cells = 40;
    if (seed % 10 == 0) shape.max_segment_bytes = 150'000, shape.cells = 8;
    const auto source = std::make_shared<SyntheticSource>(shape);
    SessionPair pair;
    std::vector<std::uint32_t> held(shape.cells, 0);
    pair.on_segment = [&](const event::SegmentArrived& s) {
      EXPECT_EQ(s.segment, pair.table->next_to_send(s.cell, held[s.cell]));
      EXPECT_TRUE(std::ranges::equal(s.bytes, source->segment(s.cell, s.segment)));
      held[s.cell] = s.segment + 1;
    };
    pair.open(source);
    pair.run();
    for (int round = 0; round < 60; ++round) {
      const auto cell = static_cast<std::uint32_t>(random() % shape.cells);
      const auto count = static_cast<std::uint32_t>(1 + random() % (shape.cells - cell));
      if (random() % 3 == 0) {
        const auto prefix = static_cast<std::uint32_t>(random() % 5);
        ASSERT_TRUE(pair.client.release({{cell, count, prefix}}));
        for (std::uint32_t i = cell; i < cell + count; ++i) held[i] = std::min(held[i], prefix);
      } else {
        ASSERT_TRUE(pair.client.set_wants({{cell, count, static_cast<std::uint32_t>(random() % 14)}}));
      }
      if (random() % 2 == 0) pair.client_to_server();
      pair.server_to_client(random() % 3000);
      if (random() % 2 == 0) pair.take_events();
      ASSERT_EQ(pair.last<event::Failed>(), nullptr) << pair.last<event::Failed>()->error.message;
    }
    ASSERT_TRUE(pair.client.set_wants(everything(*source)));
    pair.run();
    for (std::uint32_t cell = 0; cell < shape.cells; ++cell) {
      EXPECT_EQ(pair.client.held_prefix(cell), source->segment_count(cell));
    }
    EXPECT_EQ(pair.last<event::Failed>(), nullptr);
    stale += pair.client.stale_segments();
  }
  EXPECT_GT(stale, 100U) << "the test did what it is for";
}

// A client with an open model of four cells: sizes 10, 0, 20 | none | 5 | 70000, of which it wants all but the last.
struct OpenClient {
  explicit OpenClient(std::vector<CellRun> wants = {{0, 3, kAllSegments}}) : session({}, 0) {
    auto made = std::make_shared<SegmentTable>();
    for (const std::vector<std::uint32_t>& sizes :
         std::vector<std::vector<std::uint32_t>>{{10, 0, 20}, {}, {5}, {70'000}})
      made->add_cell(sizes);
    table = made;
    std::vector<std::byte> script;
    encode(Welcome{}, script);
    session.receive(script, 0);
    EXPECT_TRUE(session.next_event());
    EXPECT_TRUE(session.open("model"));
    script.clear();
    Opened opened;
    opened.cell_count = 4;
    opened.segment_total = 5;
    encode(opened, script);
    session.receive(script, 0);
    while (session.next_event()) {
    }
    EXPECT_TRUE(session.set_segment_table(table));
    EXPECT_TRUE(session.set_wants(std::move(wants)));
    while (!session.pending_output().empty()) session.written(session.pending_output().size());
  }

  void data(FrameType type, std::vector<std::uint32_t> fields, std::size_t bytes) {
    const std::vector<std::byte> blob(bytes);
    session.receive(DataFrameHeader(type, fields, blob).bytes(), 0);
    session.receive(blob, 0);
  }
  // All events' segments, and the error if there is one.
  std::string outcome() {
    std::string text;
    while (const std::optional<ClientEvent> event = session.next_event()) {
      if (const auto* s = std::get_if<event::SegmentArrived>(&*event)) {
        text += std::to_string(s->cell) + "." + std::to_string(s->segment) + " ";
      }
      if (const auto* failed = std::get_if<event::Failed>(&*event)) text += failed->error.message;
    }
    return text;
  }

  std::shared_ptr<const SegmentTable> table;
  ClientSession session;
};

TEST(SegmentBatch, NumbersAndSizesFollowFromTheTable) {
  OpenClient client;
  client.data(FrameType::segments, {0, 2, 1}, 0);
  EXPECT_NE(client.outcome().find("malformed"), std::string::npos);
  OpenClient good;
  // Two segments of cell 0 (the empty one between them is left out), one of cell 2.
  std::vector<std::byte> frame(kDataContentAt);
  WireWriter writer(frame);
  write_batch_fields(0, std::vector<BatchRun>{{0, 1, 2}, {2, 1, 1}}, writer);
  frame.resize(frame.size() + 35);
  seal_data_frame(FrameType::segments, frame);
  good.session.receive(frame, 0);
  EXPECT_EQ(good.outcome(), "0.0 0.2 2.0 ");
  EXPECT_EQ(good.session.held_prefix(0), 3U);
  EXPECT_EQ(good.session.held_prefix(1), 0U);
}

TEST(SegmentBatch, LiesAboutSegmentsAreRefusedByName) {
  const auto refusal = [](std::uint32_t releases, const std::vector<BatchRun>& runs, std::size_t bytes,
                          std::vector<CellRun> wants = {{0, 3, kAllSegments}}) {
    OpenClient client(std::move(wants));
    std::vector<std::byte> frame(kDataContentAt);
    WireWriter writer(frame);
    write_batch_fields(releases, runs, writer);
    frame.resize(frame.size() + bytes);
    seal_data_frame(FrameType::segments, frame);
    client.session.receive(frame, 0);
    return client.outcome();
  };
  const auto has = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
    EXPECT_EQ(text.find("0.0 "), std::string::npos) << "nothing of a frame that is refused is used: " << text;
  };
  has(refusal(0, {{4, 1, 1}}, 5), "cell 4, the model has 4");
  has(refusal(0, {{0, 1, 1}, {3, 1, 1}}, 70'000 - 64'000), "nobody wanted");
  has(refusal(0, {{0, 1, 3}}, 30), "no more than its 3 segments");
  has(refusal(0, {{0, 1, 1}, {1, 1, 1}}, 30), "no more than its 0 segments");
  has(refusal(0, {{2, 1, 1}, {2, 1, 1}}, 10), "no more than its 1 segments");
  has(refusal(0, {{0, 1, 1}}, 11), "by the index they have 10");
  has(refusal(0, {{0, 1, 2}}, 29), "by the index they have 30");
  has(refusal(1, {{0, 1, 1}}, 10), "after 1 releases");
  has(refusal(0, {{0, 1, 2}}, 30, {{0, 1, 2}}), "segment 2, which nobody wanted");
}

// Cells 0 and 1 have a segment each, of 10 and 6 bytes; how large those of 2 and 3 are, two each, is said by cell 0's
// and 1's.
class TellingClient {
 public:
  TellingClient() {
    table->add_cell(std::vector<std::uint32_t>{10});
    table->add_cell(std::vector<std::uint32_t>{6});
    table->add_unknown_cell(2);
    table->add_unknown_cell(2);
    std::vector<std::byte> script;
    encode(Welcome{}, script);
    session.receive(script, 0);
    EXPECT_TRUE(session.open("model"));
    Opened opened;
    opened.cell_count = 4;
    opened.segment_total = 6;
    script.clear();
    encode(opened, script);
    session.receive(script, 0);
    while (session.next_event()) {
    }
    EXPECT_TRUE(session.set_segment_table(table));
    EXPECT_TRUE(session.set_wants({{0, 4, kAllSegments}}));
    while (!session.pending_output().empty()) session.written(session.pending_output().size());
  }
  std::string outcome(const std::vector<BatchRun>& runs, std::size_t bytes, bool tells = true) {
    std::vector<std::byte> frame(kDataContentAt);
    WireWriter writer(frame);
    write_batch_fields(0, runs, writer);
    frame.resize(frame.size() + bytes);
    seal_data_frame(FrameType::segments, frame);
    session.receive(frame, 0);
    std::string text;
    while (const std::optional<ClientEvent> event = session.next_event()) {
      if (const auto* s = std::get_if<event::SegmentArrived>(&*event)) {
        text +=
            std::to_string(s->cell) + "." + std::to_string(s->segment) + ":" + std::to_string(s->bytes.size()) + " ";
        if (tells && s->cell == 0) table->learn_cell(2, std::vector<std::uint32_t>{0, 7});
        if (tells && s->cell == 1) table->learn_cell(3, std::vector<std::uint32_t>{3, 4});
      }
      if (const auto* failed = std::get_if<event::Failed>(&*event)) text += failed->error.message;
    }
    return text;
  }

  std::shared_ptr<SegmentTable> table = std::make_shared<SegmentTable>();
  ClientSession session{{}, 0};
};

TEST(SegmentBatch, ASegmentMayTellOfThoseBehindItInTheSameFrame) {
  TellingClient client;
  EXPECT_EQ(client.outcome({{0, 2, 1}, {2, 1, 1}, {3, 1, 2}}, 10 + 6 + 7 + 3 + 4), "0.0:10 1.0:6 2.1:7 3.0:3 3.1:4 ");
  for (std::uint32_t cell = 0; cell < 4; ++cell) {
    EXPECT_EQ(client.session.held_prefix(cell), client.table->segment_count(cell));
  }
  EXPECT_EQ(client.table->unknown_cells(), 0U);
  EXPECT_EQ(client.table->nonempty_total(), 5U);
  TellingClient slowly;
  EXPECT_EQ(slowly.outcome({{0, 1, 1}, {2, 1, 1}}, 17), "0.0:10 2.1:7 ");
  EXPECT_EQ(slowly.outcome({{1, 1, 1}}, 6), "1.0:6 ");
  EXPECT_EQ(slowly.outcome({{3, 1, 2}}, 7), "3.0:3 3.1:4 ");
}

TEST(SegmentBatch, SegmentsOfWhichNothingHasToldAreRefusedByName) {
  const auto has = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  has(TellingClient().outcome({{3, 1, 2}}, 7), "cell 3, before what tells of its segments");
  has(TellingClient().outcome({{0, 1, 1}, {2, 1, 1}}, 17, false), "cell 2, before what tells of its segments");
  has(TellingClient().outcome({{0, 1, 1}, {2, 1, 1}}, 18), "of 18 bytes, by the index they have 17");
  has(TellingClient().outcome({{0, 1, 1}, {2, 1, 1}}, 12), "of 12 bytes, by the index they have 17");
  has(TellingClient().outcome({{0, 1, 1}, {2, 1, 2}}, 20), "no more than its 2 segments");
  has(TellingClient().outcome({{0, 1, 1}, {3, 1, 1}}, 13), "cell 3, before");
}

TEST(SegmentBatch, PartsOutOfOrderAreRefusedByName) {
  const std::vector<CellRun> all = {{0, 4, kAllSegments}};
  const auto part = [](OpenClient& client, std::uint32_t cell, std::uint32_t offset, std::size_t bytes) {
    client.data(FrameType::segment_part, {0, cell, offset}, bytes);
  };
  {
    OpenClient client(all);
    part(client, 3, 0, 65'536), part(client, 3, 65'536, 70'000 - 65'536);
    EXPECT_EQ(client.outcome(), "3.0 ");
  }
  const auto has = [](OpenClient& client, const std::string& text) {
    const std::string outcome = client.outcome();
    EXPECT_NE(outcome.find(text), std::string::npos) << outcome;
  };
  OpenClient hole(all), other(all), long_end(all), small(all), between(all), unwanted;
  part(hole, 3, 10, 100), has(hole, "out of order");
  part(other, 3, 0, 65'536), part(other, 2, 65'536, 5), has(other, "out of order");
  part(long_end, 3, 0, 65'536), part(long_end, 3, 65'536, 5000), has(long_end, "beyond the segment's 70000 bytes");
  part(small, 0, 0, 5), has(small, "fits into one frame");
  part(between, 3, 0, 65'536), between.data(FrameType::segments, {0, 1, 0}, 10), has(between, "was complete");
  part(unwanted, 3, 0, 65'536), has(unwanted, "nobody wanted");
}

TEST(SegmentBatch, ATableOfAnotherModelIsRefused) {
  OpenClient client;
  auto other = std::make_shared<SegmentTable>();
  other->add_cell(std::vector<std::uint32_t>{1, 2, 3, 4, 5});
  EXPECT_FALSE(client.session.set_segment_table(other));
}

TEST(SegmentBatch, SegmentsWithoutATableAreAnErrorNotASilence) {
  const auto source = std::make_shared<SyntheticSource>(small_segments(3));
  SessionPair pair;
  pair.open(source);
  pair.table = nullptr;
  ASSERT_TRUE(pair.client.set_wants(everything(*source)));
  pair.run();
  ASSERT_NE(pair.last<event::Failed>(), nullptr);
  EXPECT_EQ(pair.last<event::Failed>()->error.kind, ErrorKind::usage);
}

}  // namespace
}  // namespace fanstream
