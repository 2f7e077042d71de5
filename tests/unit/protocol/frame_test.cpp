#include "protocol/frame.h"

#include <gtest/gtest.h>

#include <random>

#include "protocol/messages.h"

namespace fanstream {
namespace {

std::vector<std::byte> data_frame(FrameType type, std::vector<std::uint32_t> fields, Bytes blob) {
  const DataFrameHeader header(type, fields, blob);
  std::vector<std::byte> out(header.bytes().begin(), header.bytes().end());
  out.insert(out.end(), blob.begin(), blob.end());
  return out;
}

// One of every frame a client can get, some of them several times.
std::vector<std::byte> server_stream(std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<std::byte> out;
  encode(Welcome{1, 0, 90'000}, out);
  encode_catalogue({{"bunny", ModelState::ready, 0, "", {1, 2, 3}, 4, 5, 6}, {"cow", ModelState::building, 300, ""}},
                   out);
  encode(Building{500}, out);
  encode(Opened{}, out);
  for (int i = 0; i < 20; ++i) {
    std::vector<std::byte> blob(random() % 3000);
    for (std::byte& byte : blob) byte = static_cast<std::byte>(random());
    const auto frame = data_frame(FrameType::segments, {static_cast<std::uint32_t>(random() % 100000), 3}, blob);
    out.insert(out.end(), frame.begin(), frame.end());
    if (i % 5 == 0) encode(FrameType::ping, Ping{random()}, out);
  }
  encode(WantsDone{77, 3}, out);
  encode(ErrorMessage{ErrorCode::limit, false, 3, "text"}, out);
  return out;
}

struct Copied {
  FrameType type;
  std::vector<std::byte> payload;
  friend bool operator==(const Copied&, const Copied&) = default;
};

std::vector<Copied> read_all(FrameReader& reader) {
  std::vector<Copied> frames;
  for (auto frame = reader.next(); frame && *frame; frame = reader.next()) {
    frames.push_back({(*frame)->type, {(*frame)->payload.begin(), (*frame)->payload.end()}});
  }
  return frames;
}

TEST(FrameReader, HowTheStreamIsCutDoesNotMatter) {
  const std::vector<std::byte> stream = server_stream(1);
  FrameReader whole(Receiver::client);
  whole.push(stream);
  const std::vector<Copied> expected = read_all(whole);
  EXPECT_EQ(expected.size(), 30U);
  for (std::uint32_t seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const std::size_t largest = seed == 0 ? 1 : 1 + random() % 5000;
    FrameReader reader(Receiver::client);
    std::vector<Copied> frames;
    for (std::size_t at = 0; at < stream.size();) {
      const std::size_t size = std::min<std::size_t>(1 + random() % largest, stream.size() - at);
      reader.push(Bytes(stream).subspan(at, size));
      at += size;
      for (Copied& frame : read_all(reader)) frames.push_back(std::move(frame));
    }
    EXPECT_EQ(frames, expected);
    EXPECT_FALSE(reader.mid_frame());
    EXPECT_EQ(reader.offset_bytes(), stream.size());
  }
}

TEST(FrameReader, AFrameSealedInPlaceIsTheSameAsOneOfTwoPieces) {
  for (const std::size_t size : {0U, 1U, 100U, 300U, 5000U}) {
    const std::vector<std::byte> blob(size, std::byte{9});
    std::vector<std::byte> sealed(kDataContentAt);
    WireWriter writer(sealed);
    writer.varint(7), writer.varint(300), writer.bytes(blob);
    seal_data_frame(FrameType::segments, sealed);
    EXPECT_EQ(sealed, data_frame(FrameType::segments, {7, 300}, blob));
  }
}

TEST(FrameReader, OneFlippedBitInADataFrameIsAlwaysNoticed) {
  std::vector<std::byte> blob(600, std::byte{7});
  const std::vector<std::byte> frame = data_frame(FrameType::segments, {5, 1}, blob);
  for (std::size_t bit = 32; bit < frame.size() * 8; ++bit) {  // after the frame header: the checksum, fields and blob
    std::vector<std::byte> damaged = frame;
    damaged[bit / 8] ^= static_cast<std::byte>(1U << (bit % 8));
    FrameReader reader(Receiver::client);
    reader.push(damaged);
    const auto result = reader.next();
    ASSERT_FALSE(result) << "bit " << bit;
    EXPECT_NE(result.error().message.find("checksum"), std::string::npos);
  }
}

TEST(FrameReader, ClaimedSizesAreCheckedWithTheHeaderAlone) {
  for (int type = 0; type < 256; ++type) {
    for (const Receiver receiver : {Receiver::server, Receiver::client}) {
      const auto limit = max_payload_bytes(static_cast<FrameType>(type), receiver);
      const std::size_t claimed = limit.value_or(0) + 1;
      FrameReader reader(receiver);
      reader.push(std::array{static_cast<std::byte>(type), static_cast<std::byte>(claimed),
                             static_cast<std::byte>(claimed >> 8), static_cast<std::byte>(claimed >> 16)});
      EXPECT_FALSE(reader.next()) << "type " << type;
    }
  }
}

TEST(FrameReader, AnErrorNamesTheStreamOffsetAndStays) {
  std::vector<std::byte> stream;
  encode(FrameType::ping, Ping{1}, stream);
  stream.push_back(std::byte{0x77});
  FrameReader reader(Receiver::client);
  reader.push(stream);
  EXPECT_TRUE(reader.next());
  const auto first = reader.next();
  ASSERT_FALSE(first);
  EXPECT_NE(first.error().message.find("stream byte 12"), std::string::npos) << first.error().message;
  EXPECT_NE(first.error().message.find("0x77"), std::string::npos);
  encode(FrameType::ping, Ping{1}, stream);
  reader.push(stream);
  const auto second = reader.next();
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().message, first.error().message);
}

TEST(FrameReader, OnlyTheHandshakeIsTakenBeforeTheHandshake) {
  FrameReader reader(Receiver::server);
  reader.restrict_to(FrameType::hello);
  std::vector<std::byte> stream;
  encode(Wants{1, {}}, stream);
  reader.push(Bytes(stream).first(1));
  EXPECT_FALSE(reader.next());
}

TEST(FrameReader, ALongStreamTakesNoMoreMemoryThanAFrame) {
  const std::vector<std::byte> stream = server_stream(2);
  FrameReader reader(Receiver::client);
  for (int i = 0; i < 2000; ++i) {
    reader.push(stream);
    EXPECT_EQ(read_all(reader).size(), 30U);
  }
  EXPECT_LE(reader.memory_bytes(), 2 * stream.size());
}

TEST(FrameReader, MutatedStreamsNeverCrashIt) {
  for (std::uint32_t seed = 0; seed < 500; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::vector<std::byte> stream = server_stream(seed % 4);
    for (int i = 0; i < 3; ++i) stream[random() % stream.size()] = static_cast<std::byte>(random());
    if (seed % 3 == 0) stream.resize(random() % stream.size());
    for (const Receiver receiver : {Receiver::server, Receiver::client}) {
      FrameReader reader(receiver);
      reader.push(stream);
      EXPECT_LE(read_all(reader).size(), 30U + 3U * 1000U);
    }
  }
}

}  // namespace
}  // namespace fanstream
