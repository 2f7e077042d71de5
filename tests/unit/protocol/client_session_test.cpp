// What the client's end promises whoever uses it: that waiting has an end, and that what it says of wants is so.
#include "protocol/client_session.h"

#include <gtest/gtest.h>

#include "tests/unit/protocol/session_pair.h"

namespace fanstream {
namespace {

// An asset of which the server lacks one segment.
class LackingSource final : public SegmentSource {
 public:
  LackingSource(std::shared_ptr<const SyntheticSource> whole, CellPrefix lacked)
      : whole_(std::move(whole)), lacked_(lacked) {}
  Digest digest() const override { return whole_->digest(); }
  Bytes head() const override { return whole_->head(); }
  Bytes index() const override { return whole_->index(); }
  std::uint32_t cell_count() const override { return whole_->cell_count(); }
  std::uint32_t segment_count(std::uint32_t cell) const override { return whole_->segment_count(cell); }
  Bytes segment(std::uint32_t cell, std::uint32_t segment) const override {
    return CellPrefix{cell, segment} == lacked_ ? Bytes() : whole_->segment(cell, segment);
  }
  std::uint64_t vertex_count() const override { return whole_->vertex_count(); }
  std::uint64_t triangle_count() const override { return whole_->triangle_count(); }
  std::uint64_t size_bytes() const override { return whole_->size_bytes(); }

 private:
  std::shared_ptr<const SyntheticSource> whole_;
  CellPrefix lacked_;
};

std::vector<CellRun> everything(const SegmentSource& source) { return {{0, source.cell_count(), kAllSegments}}; }

// The last segment of the last cell that has any with bytes.
CellPrefix last_segment(const SyntheticSource& source) {
  for (std::uint32_t cell = source.cell_count(); cell-- > 0;) {
    for (std::uint32_t segment = source.segment_count(cell); segment-- > 0;) {
      if (!source.segment(cell, segment).empty()) return {cell, segment};
    }
  }
  return {};
}

TEST(ClientSession, AListSaidToBeServedWithASegmentMissingEndsTheSessionByName) {
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const auto whole = std::make_shared<SyntheticSource>(SyntheticShape{seed, 30, 4, 300});
    const CellPrefix lacked = last_segment(*whole);
    SessionPair pair;
    pair.open(std::make_shared<LackingSource>(whole, lacked));
    pair.table = whole->table();
    // A list without it is served.
    ASSERT_TRUE(pair.client.set_wants({{0, lacked.cell, kAllSegments}, {lacked.cell, 1, lacked.prefix}}));
    pair.run();
    ASSERT_NE(pair.last<event::WantsServed>(), nullptr);
    ASSERT_EQ(pair.last<event::Failed>(), nullptr);
    ASSERT_TRUE(pair.client.set_wants(everything(*whole)));
    pair.run();
    const auto* failed = pair.last<event::Failed>();
    ASSERT_NE(failed, nullptr);
    EXPECT_EQ(failed->error.kind, ErrorKind::bad_input);
    const std::string missing =
        "segment " + std::to_string(lacked.prefix) + " of cell " + std::to_string(lacked.cell) + ",";
    EXPECT_NE(failed->error.message.find(missing), std::string::npos) << failed->error.message;
  }
}

// The second request left before the first answer came: it may be served with it, or by itself.
TEST(ClientSession, ACatalogueMayComeForEachRequestButNotMoreOften) {
  ClientSession session({}, 0);
  std::vector<std::byte> welcome, catalogue;
  encode(Welcome{}, welcome);
  encode_catalogue({{"m", ModelState::failed, 0, "broken"}}, catalogue);
  session.receive(welcome, 1);
  ASSERT_TRUE(std::holds_alternative<event::Welcomed>(session.next_event().value()));
  session.list();
  session.list();
  for (int i = 0; i < 2; ++i) {
    session.receive(catalogue, 2);
    const std::optional<ClientEvent> event = session.next_event();
    ASSERT_TRUE(event && std::holds_alternative<event::Catalogue>(*event)) << i;
  }
  session.receive(catalogue, 3);
  const std::optional<ClientEvent> event = session.next_event();
  ASSERT_TRUE(event && std::holds_alternative<event::Failed>(*event));
  EXPECT_NE(std::get<event::Failed>(*event).error.message.find("without being asked"), std::string::npos);
}

TEST(ClientSession, AListSaidToBeServedBeforeTheIndexEndsTheSession) {
  ClientSession session({}, 0);
  ASSERT_TRUE(session.open("model"));
  ASSERT_TRUE(session.set_wants({{0, 1, kAllSegments}}));
  while (!session.pending_output().empty()) session.written(session.pending_output().size());
  std::vector<std::byte> script;
  encode(Welcome{}, script);
  Opened opened;
  opened.cell_count = 1;
  opened.segment_total = 1;
  opened.head_size_bytes = opened.index_size_bytes = 10;
  encode(opened, script);
  encode(WantsDone{1, 0}, script);
  session.receive(script, 0);
  std::string error;
  while (const std::optional<ClientEvent> event = session.next_event()) {
    if (const auto* failed = std::get_if<event::Failed>(&*event)) error = failed->error.message;
  }
  EXPECT_NE(error.find("before the index"), std::string::npos) << error;
}

// A list followed by releases is served without what these have dropped, which is no fault of the server's.
TEST(ClientSession, WhatWasReleasedAfterTheListMayBeMissingWhenItIsServed) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    const auto source = std::make_shared<SyntheticSource>(SyntheticShape{seed, 60, 6, 1500});
    SessionPair pair;
    pair.open(source);
    pair.run();
    ASSERT_TRUE(pair.client.set_wants(everything(*source)));
    pair.client_to_server();
    pair.server_to_client(20'000 + 1'000 * seed);
    pair.take_events();
    ASSERT_TRUE(pair.client.release({{0, source->cell_count(), seed % 3}}));
    pair.run();
    EXPECT_EQ(pair.last<event::Failed>(), nullptr) << pair.last<event::Failed>()->error.message;
    EXPECT_FALSE(pair.client.wants_outstanding());
    std::uint64_t held = 0;
    for (std::uint32_t cell = 0; cell < source->cell_count(); ++cell) {
      held += pair.client.held_prefix(cell) == source->segment_count(cell) ? 1 : 0;
    }
    EXPECT_LT(held, source->cell_count()) << "something was missing";
    ASSERT_TRUE(pair.client.set_wants(everything(*source)));
    pair.run();
    for (std::uint32_t cell = 0; cell < source->cell_count(); ++cell) {
      EXPECT_EQ(pair.client.held_prefix(cell), source->segment_count(cell));
    }
  }
}

// Every second cell is released to another prefix than the rest: more runs than one frame takes.
TEST(ClientSession, AReleaseOfAnySizeIsTold) {
  const auto source = std::make_shared<SyntheticSource>(SyntheticShape{1, 140'000, 3, 4, 10, 10, 0});
  SessionPair pair;
  pair.open(source);
  ASSERT_TRUE(pair.client.set_wants(everything(*source)));
  pair.run();
  std::vector<CellPrefix> list;
  for (std::uint32_t cell = 0; cell < source->cell_count(); ++cell) list.push_back({cell, cell % 2});
  const std::vector<CellRun> runs = to_runs(list);
  ASSERT_FALSE(check_runs(runs));
  const Result<void> released = pair.client.release(runs);
  ASSERT_TRUE(released) << released.error().message;
  ReceivedModel received(*source);
  std::uint64_t again = 0;
  for (std::uint32_t cell = 0; cell < source->cell_count(); ++cell) {
    ASSERT_EQ(pair.client.held_prefix(cell),
              source->table()->next_to_send(cell, std::min(cell % 2, source->segment_count(cell))));
    for (std::uint32_t s = cell % 2; s < source->segment_count(cell); ++s) again += !source->segment(cell, s).empty();
  }
  const std::size_t before = pair.arrived_cells.size();
  ASSERT_TRUE(pair.client.set_wants(everything(*source)));
  pair.run();
  EXPECT_EQ(pair.last<event::Failed>(), nullptr) << pair.last<event::Failed>()->error.message;
  EXPECT_EQ(pair.arrived_cells.size() - before, again);
  EXPECT_EQ(pair.client.stale_segments(), 0U);
  const Result<void> beyond = pair.client.release({{source->cell_count(), 1, 0}});
  EXPECT_FALSE(beyond);
  EXPECT_FALSE(pair.client.release({{0, 1, kMaxSegmentsPerCell + 1}}));
}

// A client that has been told of a head of one frame, and what came of the bytes it got since.
struct SlowLine {
  SlowLine() {
    std::vector<std::byte> script;
    encode(Welcome{}, script);
    session.receive(script, 0);
    EXPECT_TRUE(session.open("model"));
    Opened opened;
    opened.cell_count = 1;
    opened.segment_total = 1;
    opened.head_size_bytes = kMaxChunkBytes;
    opened.index_size_bytes = 1;
    script.clear();
    encode(opened, script);
    session.receive(script, 0);
    while (session.next_event()) {
    }
    while (!session.pending_output().empty()) session.written(session.pending_output().size());
    const std::vector<std::byte> blob(kMaxChunkBytes);
    const DataFrameHeader header(FrameType::head_data, std::array<std::uint32_t, 1>{0}, blob);
    frame.assign(header.bytes().begin(), header.bytes().end());
    frame.insert(frame.end(), blob.begin(), blob.end());
  }
  // So many bytes of the frame come each second; until it is complete or the session has ended.
  std::string outcome(std::size_t bytes_each_second) {
    std::size_t at = 0;
    for (TimeMs now_ms = 1000; now_ms < 1'000'000'000; now_ms += 1000) {
      const std::size_t size = std::min(bytes_each_second, frame.size() - at);
      session.receive(Bytes(frame).subspan(at, size), now_ms);
      at += size;
      while (const std::optional<ClientEvent> event = session.next_event()) {
        if (const auto* failed = std::get_if<event::Failed>(&*event)) return failed->error.message;
        if (std::holds_alternative<event::HeadComplete>(*event)) return "complete";
      }
      session.tick(now_ms);
      ended_ms = now_ms;
    }
    return "endless";
  }
  ClientSession session{{}, 0};
  std::vector<std::byte> frame;
  TimeMs ended_ms = 0;
};

TEST(ClientSession, AFrameThatTakesLongerThanTheTimeoutIsNoStall) {
  for (const std::size_t bytes_each_second : {1500U, 200U, 40U}) {
    SCOPED_TRACE(bytes_each_second);
    SlowLine line;
    EXPECT_EQ(line.outcome(bytes_each_second), "complete");
    EXPECT_GT(line.ended_ms, ClientSessionOptions{}.stall_timeout_ms);
  }
}

TEST(ClientSession, AFrameThatOnlyTricklesInEndsTheSession) {
  for (const std::size_t bytes_each_second : {0U, 1U, 30U}) {
    SCOPED_TRACE(bytes_each_second);
    SlowLine line;
    const std::string outcome = line.outcome(bytes_each_second);
    EXPECT_NE(outcome.find("stalled"), std::string::npos) << outcome;
    EXPECT_NE(outcome.find("the model's head"), std::string::npos) << outcome;
    EXPECT_LE(line.ended_ms, 35'000);
  }
}

}  // namespace
}  // namespace fanstream
