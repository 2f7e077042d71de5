// The seeds of the fuzz targets of the protocol are the golden transcripts, so that they speak the version there is.
// FANSTREAM_UPDATE_GOLDEN=1 writes them anew; commit them when the transcripts have changed.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "protocol/messages.h"
#include "tests/support/transcript.h"

namespace fanstream {
namespace {

using testing::Line;
using Seed = std::vector<std::byte>;

constexpr const char* kNames[] = {"whole_model", "levels_and_release", "release_under_way",
                                  "resume",      "refusals",           "version_mismatch"};

std::string source_path(const std::string& path) { return std::string(FANSTREAM_SOURCE_DIR) + "/tests/" + path; }

void add(Seed& seed, std::initializer_list<unsigned> bytes) {
  for (const unsigned byte : bytes) seed.push_back(static_cast<std::byte>(byte));
}

void add(Seed& seed, Bytes bytes) { seed.insert(seed.end(), bytes.begin(), bytes.end()); }

// fuzz_frame_reader: side and size of pieces, then the stream.
Seed stream_seed(const std::vector<Line>& lines, char side) {
  Seed seed;
  add(seed, {side == 'S' ? 0x0BU : 0x00U});
  for (const Line& line : lines) {
    if (line.side == side) add(seed, line.bytes);
  }
  return seed;
}

// fuzz_sessions: the handshake is made by the target; then each frame as an act, and everything that the machine says
// is taken.
Seed session_seed(const std::vector<Line>& lines, char side) {
  Seed seed;
  add(seed, {1});
  for (const Line& line : lines) {
    const auto type = static_cast<FrameType>(line.bytes[0]);
    if (line.side != side || type == FrameType::hello || type == FrameType::welcome) continue;
    const Bytes payload = Bytes(line.bytes).subspan(kFrameHeaderBytes);
    if (is_data_frame(type)) {
      add(seed, {2, static_cast<unsigned>(line.bytes.size())});
      add(seed, line.bytes);
    } else {
      add(seed, {0, static_cast<unsigned>(type), static_cast<unsigned>(payload.size())});
      add(seed, payload);
    }
    add(seed, {3, 255});
  }
  return seed;
}

// A server of the target's own model, which gives its segments in batches: cells 1, 2, 3 (its second segment is empty).
Seed batches_seed() {
  Seed seed;
  add(seed, {1});
  std::vector<std::byte> frame;
  Opened opened;
  opened.cell_count = 9;
  opened.segment_total = 12;
  encode(opened, frame);
  add(seed, {0, static_cast<unsigned>(FrameType::opened), static_cast<unsigned>(frame.size() - kFrameHeaderBytes)});
  add(seed, Bytes(frame).subspan(kFrameHeaderBytes));
  add(seed, {3, 255});
  const auto batch = [&](std::uint32_t releases, const std::vector<BatchRun>& runs, std::size_t bytes) {
    std::vector<std::byte> whole(kDataContentAt);
    WireWriter writer(whole);
    write_batch_fields(releases, runs, writer);
    whole.resize(whole.size() + bytes, std::byte{5});
    seal_data_frame(FrameType::segments, whole);
    add(seed, {2, static_cast<unsigned>(whole.size())});
    add(seed, whole);
  };
  batch(0, {{1, 1, 1}, {2, 1, 1}, {3, 1, 2}}, 10 + 20 + 30 + 32);
  add(seed, {5, 3, 2, 3, 0, 3, 255});  // wants cell 3 to prefix 2, releases all of it, and all of that leaves
  batch(0, {{5, 1, 1}}, 50);
  batch(1, {{3, 1, 1}}, 30);
  return seed;
}

void expect_seed(const std::string& path, const Seed& seed) {
  SCOPED_TRACE(path);
  if (std::getenv("FANSTREAM_UPDATE_GOLDEN") != nullptr) {
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(seed.data()), static_cast<std::streamsize>(seed.size()));
  }
  std::ifstream file(path, std::ios::binary);
  const std::vector<char> found{std::istreambuf_iterator<char>(file), {}};
  EXPECT_TRUE(std::ranges::equal(std::as_bytes(std::span(found)), seed));
}

TEST(FuzzSeeds, OfTheProtocolAreTheGoldenTranscripts) {
  for (const std::string name : kNames) {
    const std::vector<Line> lines = testing::read_transcript(source_path("golden/protocol/" + name + ".txt"));
    expect_seed(source_path("fuzz/seeds/frame_reader/" + name + "_to_server"), stream_seed(lines, 'C'));
    expect_seed(source_path("fuzz/seeds/frame_reader/" + name + "_to_client"), stream_seed(lines, 'S'));
    expect_seed(source_path("fuzz/seeds/sessions/" + name + "_server"), session_seed(lines, 'C'));
    expect_seed(source_path("fuzz/seeds/sessions/" + name + "_client"), session_seed(lines, 'S'));
  }
  expect_seed(source_path("fuzz/seeds/sessions/batches_client"), batches_seed());
}

}  // namespace
}  // namespace fanstream
