#include "protocol/messages.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>

namespace fanstream {
namespace {

using Encoded = std::vector<std::byte>;

Bytes payload_of(const Encoded& frame) { return Bytes(frame).subspan(kFrameHeaderBytes); }

const std::vector<CellRun> kRuns = {
    {0, 10'000, kAllSegments}, {5, 1, 0}, {4'000'000, 2, 65535}, {3, 1, 7}, {4, 300, 7}};

// A message of every kind with a decoder that says whether it was accepted and gives back what it read, encoded again.
struct Kind {
  std::string name;
  Encoded frame;
  std::function<Result<Encoded>(Bytes)> recode;
  bool open_ended = false;  // takes longer payloads: the handshake, and blobs
};

template <class Message>
Kind kind(std::string name, const Message& message, Result<Message> (*decode)(Bytes), bool open_ended = false) {
  Kind made{std::move(name), {}, {}, open_ended};
  encode(message, made.frame);
  made.recode = [decode](Bytes payload) -> Result<Encoded> {
    const Result<Message> read = decode(payload);
    if (!read) return tl::unexpected<Error>(read.error());
    Encoded again;
    encode(*read, again);
    return again;
  };
  return made;
}

std::vector<Kind> all_kinds() {
  Have have{{9, 8, 7}, true, false, kRuns};
  std::vector<Kind> kinds = {
      kind("hello", Hello{1, 3, 0x80000001U}, decode_hello, true),
      kind("welcome", Welcome{2, 5, 90'000}, decode_welcome),
      kind("open", Open{"B\xC3\xA4r", {}}, decode_open),
      kind("open with have", Open{"bunny", have}, decode_open),
      kind("wants", Wants{0xFFFFFFFFU, kRuns}, decode_wants),
      kind("wants nothing", Wants{1, {}}, decode_wants),
      kind("release", Release{kRuns}, decode_release),
      kind("credit", Credit{kMaxCredit}, decode_credit),
      kind("building", Building{1000}, decode_building),
      kind("opened", Opened{true, {1, 2, 3}, kMaxCells, 1ULL << 37, kMaxHeadBytes, 0, ~0ULL, 1ULL << 40, 300},
           decode_opened),
      kind("wants done", WantsDone{1'000'000, 70'000}, decode_wants_done),
      kind("degraded", Degraded{DegradedReason::no_credit, "because"}, decode_degraded),
      kind("error", ErrorMessage{ErrorCode::want_out_of_range, false, 77, "text"}, decode_error),
  };
  Kind ping{"ping", {}, {}, false};
  encode(FrameType::ping, Ping{~0ULL}, ping.frame);
  ping.recode = [](Bytes payload) -> Result<Encoded> {
    const Result<Ping> read = decode_ping(payload);
    if (!read) return tl::unexpected<Error>(read.error());
    Encoded again;
    encode(FrameType::ping, *read, again);
    return again;
  };
  kinds.push_back(ping);
  Kind catalogue{"catalogue", {}, {}, false};
  encode_catalogue({{"bunny", ModelState::ready, 0, "", {1, 2}, 100'000, 35'000, 69'000},
                    {"cow", ModelState::building, 999, ""},
                    {"pig", ModelState::failed, 0, "no triangles"}},
                   catalogue.frame);
  catalogue.recode = [](Bytes payload) -> Result<Encoded> {
    const Result<CataloguePart> read = decode_catalogue(payload);
    if (!read) return tl::unexpected<Error>(read.error());
    Encoded again;
    encode_catalogue(read->entries, again);
    return again;
  };
  kinds.push_back(catalogue);
  return kinds;
}

TEST(Messages, EveryKindComesBackAsItWas) {
  for (const Kind& kind : all_kinds()) {
    SCOPED_TRACE(kind.name);
    const Result<Encoded> again = kind.recode(payload_of(kind.frame));
    ASSERT_TRUE(again) << again.error().message;
    EXPECT_EQ(*again, kind.frame);
  }
}

TEST(Messages, EveryTruncationIsAnError) {
  for (const Kind& kind : all_kinds()) {
    SCOPED_TRACE(kind.name);
    const Bytes payload = payload_of(kind.frame);
    for (std::size_t size = 0; size < payload.size(); ++size) {
      const Encoded exact(payload.begin(),
                          payload.begin() + static_cast<std::ptrdiff_t>(size));  // ASan sees an over-read
      EXPECT_FALSE(kind.recode(exact)) << size;
    }
  }
}

TEST(Messages, ALeftOverByteIsAnError) {
  for (const Kind& kind : all_kinds()) {
    SCOPED_TRACE(kind.name);
    Encoded longer(payload_of(kind.frame).begin(), payload_of(kind.frame).end());
    longer.push_back(std::byte{0});
    EXPECT_EQ(kind.recode(longer).has_value(), kind.open_ended);
  }
}

TEST(Messages, WhatIsAcceptedAfterMutationHasOneForm) {
  // Strictness: no two payloads mean the same, so anything accepted encodes back to itself.
  const std::vector<Kind> kinds = all_kinds();
  std::size_t accepted = 0;
  for (std::uint32_t seed = 0; seed < 20'000; ++seed) {
    std::mt19937 random(seed);
    const Kind& kind = kinds[seed % kinds.size()];
    const Bytes payload = payload_of(kind.frame);
    Encoded mutated(payload.begin(), payload.end());
    if (mutated.empty()) continue;
    for (std::uint32_t i = 0; i < 1 + seed % 3; ++i)
      mutated[random() % mutated.size()] = static_cast<std::byte>(random());
    const Result<Encoded> again = kind.recode(mutated);
    if (!again || kind.open_ended || kind.name == "catalogue") continue;
    ++accepted;
    const Bytes again_payload = payload_of(*again);
    // Runs can be written in more ways than one (joined or not); all others cannot.
    if (kind.name.find("wants") == std::string::npos && kind.name != "release" && kind.name != "open with have") {
      EXPECT_TRUE(std::ranges::equal(again_payload, mutated)) << kind.name << ", seed " << seed;
    }
  }
  EXPECT_GT(accepted, 1000U);
}

TEST(Messages, ListsBeyondTheLimitsAreRefusedWithoutMemoryForThem) {
  const auto wants = [](const std::function<void(WireWriter&)>& fill) {
    Encoded payload;
    WireWriter writer(payload);
    writer.varint(1);  // epoch
    fill(writer);
    return decode_wants(payload);
  };
  EXPECT_FALSE(wants([](WireWriter& w) { w.varint(kMaxRuns); }));                     // claims, holds none
  EXPECT_FALSE(wants([](WireWriter& w) { w.varint(1), w.varint(1), w.varint(0); }));  // cell -1
  EXPECT_FALSE(wants([](WireWriter& w) { w.varint(1), w.varint(2ULL * kMaxCells), w.varint(0); }));  // beyond the last
  EXPECT_FALSE(wants([](WireWriter& w) { w.varint(1), w.varint(0), w.varint(1), w.varint(kMaxCells); }));
  EXPECT_TRUE(wants([](WireWriter& w) { w.varint(1), w.varint(0), w.varint(1), w.varint(kMaxCells - 2); }));
  EXPECT_FALSE(wants([](WireWriter& w) {  // each run allowed, their sum not
    w.varint(17);
    for (int i = 0; i < 17; ++i) w.varint(i == 0 ? 0 : 2ULL * kMaxCells - 1), w.varint(1), w.varint(kMaxCells - 2);
  }));
}

TEST(Messages, RunsJoinNeighboursAndKeepTheOrder) {
  const std::vector<CellPrefix> list = {{4, 2}, {5, 2}, {6, 2}, {6, 3}, {7, 3}, {1, 1}};
  EXPECT_EQ(to_runs(list), (std::vector<CellRun>{{4, 3, 2}, {6, 2, 3}, {1, 1, 1}}));
}

TEST(Messages, RunsThatCannotBeSentAreRefused) {
  EXPECT_FALSE(check_runs(std::vector<CellRun>{{0, 0, 1}}));
  EXPECT_FALSE(check_runs(std::vector<CellRun>{{kMaxCells, 1, 1}}));
  EXPECT_FALSE(check_runs(std::vector<CellRun>{{0, 1, kMaxSegmentsPerCell + 1}}));
  EXPECT_FALSE(check_runs(std::vector<CellRun>(kMaxRuns + 1, CellRun{})));
  EXPECT_TRUE(check_runs(std::vector<CellRun>(kMaxRuns, CellRun{0, 1, 1})));
}

TEST(Messages, ALongCatalogueTakesSeveralFrames) {
  std::vector<CatalogueEntry> entries;
  for (int i = 0; i < 5000; ++i)
    entries.push_back({"model " + std::to_string(i), ModelState::failed, 0, "because of this"});
  Encoded out;
  encode_catalogue(entries, out);
  FrameReader reader(Receiver::client);
  reader.push(out);
  std::vector<CatalogueEntry> read;
  int frames = 0;
  bool last = false;
  for (auto frame = reader.next(); frame && *frame; frame = reader.next()) {
    EXPECT_FALSE(last);
    const Result<CataloguePart> part = decode_catalogue((*frame)->payload);
    ASSERT_TRUE(part) << part.error().message;
    read.insert(read.end(), part->entries.begin(), part->entries.end());
    last = part->last;
    ++frames;
  }
  EXPECT_TRUE(last);
  EXPECT_GT(frames, 1);
  EXPECT_EQ(read, entries);
}

TEST(Messages, TextThatCouldReachATerminalIsCleanOnBothSides) {
  EXPECT_TRUE(is_printable_utf8("Bär \xE2\x82\xAC \xF0\x9F\x90\xB0"));
  for (const char* bad :
       {"\x1b[2J", "a\nb", "\x7f", "\xC0\xAF", "\xED\xA0\x80", "\xF5\x80\x80\x80", "\xE2\x82", "\xC2\x9B"}) {
    EXPECT_FALSE(is_printable_utf8(bad));
    Encoded out;
    encode(ErrorMessage{ErrorCode::internal, true, 0, bad}, out);
    const Result<ErrorMessage> read = decode_error(payload_of(out));
    ASSERT_TRUE(read);
    EXPECT_TRUE(is_printable_utf8(read->text));
    Encoded raw;
    WireWriter writer(raw);
    writer.u16(1), writer.u8(1), writer.u32(0), writer.varint(std::string_view(bad).size()),
        writer.bytes(as_bytes(bad));
    EXPECT_FALSE(decode_error(raw));
  }
}

TEST(Messages, VarintsHaveOneForm) {
  for (const std::uint64_t value : {0ULL, 127ULL, 128ULL, 16383ULL, 16384ULL, 1ULL << 32, ~0ULL}) {
    Encoded out;
    WireWriter writer(out);
    writer.varint(value);
    WireReader reader(out);
    EXPECT_EQ(reader.varint(), value);
    EXPECT_TRUE(reader.at_end());
  }
  for (const std::vector<std::byte>& bad : {Encoded{std::byte{0x80}, std::byte{0}}, Encoded(10, std::byte{0xFF}),
                                            Encoded(11, std::byte{0x80}), Encoded{std::byte{0x80}}}) {
    WireReader reader(bad);
    reader.varint();
    EXPECT_FALSE(reader.ok());
  }
}

Encoded batch_payload(std::uint32_t releases, const std::vector<BatchRun>& runs, std::size_t bytes) {
  Encoded payload;
  WireWriter writer(payload);
  write_batch_fields(releases, runs, writer);
  payload.resize(payload.size() + bytes, std::byte{1});
  return payload;
}

TEST(Messages, BatchesOfSegmentsComeBackAsTheyWere) {
  const std::vector<std::vector<BatchRun>> lists = {{{0, 1, 1}},
                                                    {{7, 1, 1}, {3, 1, 9}, {4, 200, 1}, {1, 2, 30}},
                                                    {{kMaxCells - 1, 1, 1}, {0, 3, 2}, {kMaxCells - 2, 2, 1}}};
  for (const std::vector<BatchRun>& runs : lists) {
    const Result<SegmentBatch> batch = decode_segments(batch_payload(300, runs, 1000));
    ASSERT_TRUE(batch) << batch.error().message;
    EXPECT_EQ(batch->release_count, 300U);
    EXPECT_EQ(batch->runs, runs);
    EXPECT_EQ(batch->bytes.size(), 1000U);
  }
}

TEST(Messages, ABatchCostsLittleForEachSegment) {
  std::vector<BatchRun> in_order, near, scattered;
  for (std::uint32_t i = 0; i < 100; ++i) {
    add_to_batch(5000 + i, 1, in_order);
    add_to_batch(5000 + i * 3, 1, near);
    add_to_batch(i * 7919 % 4000, 1, scattered);
  }
  EXPECT_LE(batch_payload(0, in_order, 0).size(), 8U);
  EXPECT_LE(batch_payload(0, near, 0).size(), 105U);
  EXPECT_LE(batch_payload(0, scattered, 0).size(), 205U + 50U);
}

TEST(Messages, MalformedBatchesAreRefused) {
  const auto batch = [](std::initializer_list<std::uint64_t> fields, std::size_t bytes) {
    Encoded payload;
    WireWriter writer(payload);
    for (const std::uint64_t field : fields) writer.varint(field);
    payload.resize(payload.size() + bytes, std::byte{1});
    return decode_segments(payload).has_value();
  };
  EXPECT_TRUE(batch({0, 1, 0}, 1));
  EXPECT_FALSE(batch({0, 0}, 10));                         // no run
  EXPECT_FALSE(batch({0, 1, 0}, 0));                       // a segment without a byte
  EXPECT_FALSE(batch({0, 70'000, 0}, 60'000));             // more runs than a frame can hold
  EXPECT_FALSE(batch({0, 60'000, 0}, 60'000));             // more runs than bytes
  EXPECT_FALSE(batch({0, 1, 1, 0}, 10));                   // one segment of one cell in the longer form
  EXPECT_FALSE(batch({0, 1, 2}, 10));                      // cell -1
  EXPECT_TRUE(batch({0, 1, 4ULL * (kMaxCells - 1)}, 10));  // the last cell
  EXPECT_FALSE(batch({0, 1, 4ULL * kMaxCells}, 10));       // beyond it
  EXPECT_FALSE(batch({0, 1, 4ULL * (kMaxCells - 1) + 1, 1, 0}, 10));
  EXPECT_FALSE(batch({0, 1, 1, 2ULL * 10}, 10));  // eleven segments in ten bytes
  EXPECT_TRUE(batch({0, 1, 1, 2ULL * 9}, 10));
  EXPECT_FALSE(batch({0, 1, 1, 2ULL * 3 + 1, 3}, 19));  // five cells of four segments
  EXPECT_TRUE(batch({0, 1, 1, 2ULL * 3 + 1, 3}, 20));
  EXPECT_FALSE(batch({0, 1, 1, 2ULL * kMaxSegmentsPerCell, 0}, 10));
  EXPECT_FALSE(batch({0, 1, 0}, kMaxChunkBytes + 1));
  EXPECT_FALSE(batch({1ULL << 32, 1, 0}, 1));
}

TEST(Messages, MutatedBatchesAreBoundedByTheirBytes) {
  const Encoded payload = batch_payload(3, {{70, 1, 1}, {3, 1, 9}, {4, 60, 2}, {1, 2, 30}}, 300);
  std::size_t accepted = 0;
  for (std::uint32_t seed = 0; seed < 20'000; ++seed) {
    std::mt19937 random(seed);
    Encoded mutated = payload;
    for (std::uint32_t i = 0; i < 1 + seed % 3; ++i) mutated[random() % 16] = static_cast<std::byte>(random());
    const Result<SegmentBatch> batch = decode_segments(mutated);
    if (!batch) continue;
    ++accepted;
    std::uint64_t segments = 0;
    for (const BatchRun& run : batch->runs) {
      segments += std::uint64_t{run.cell_count} * run.segment_count;
      ASSERT_LE(std::uint64_t{run.first_cell} + run.cell_count, kMaxCells) << "seed " << seed;
    }
    ASSERT_LE(segments, batch->bytes.size()) << "seed " << seed;
    Encoded again;
    WireWriter writer(again);
    write_batch_fields(batch->release_count, batch->runs, writer);
    writer.bytes(batch->bytes);
    ASSERT_EQ(again, mutated) << "one form only, seed " << seed;
  }
  EXPECT_GT(accepted, 1000U);
}

TEST(Messages, SegmentPartsHaveBytesAndACellThatCanBe) {
  const auto part = [](std::uint64_t cell, std::uint64_t offset, std::size_t size) {
    Encoded payload;
    WireWriter writer(payload);
    writer.varint(1), writer.varint(cell), writer.varint(offset);
    payload.resize(payload.size() + size);
    return decode_segment_part(payload).has_value();
  };
  EXPECT_TRUE(part(100, 60, 40));
  EXPECT_FALSE(part(kMaxCells, 60, 40));
  EXPECT_FALSE(part(100, kMaxSegmentBytes + 1ULL, 40));
  EXPECT_FALSE(part(100, 60, 0));
  EXPECT_FALSE(part(100, 60, kMaxChunkBytes + 1));
}

}  // namespace
}  // namespace fanstream
