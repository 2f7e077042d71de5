// Segments as a view asks for them: the same from a file, a server, a server that breaks off, and a cache on disk.
#include "client/model/segment_stream.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/asset_helpers.h"
#include "tests/support/built_model.h"
#include "tests/support/cutting_relay.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/seeded_random.h"
#include "tests/support/temporary_folder.h"

namespace fanstream {
namespace {

using testing::ModelServer;
using testing::RepeatedlyCuttingRelay;
using testing::SeededRandom;
using testing::TemporaryFolder;

const std::shared_ptr<const AssetFile>& asset() {
  static const auto built = testing::build_model(testing::make_terrain(70, 60, 5), testing::small_cells());
  return built;
}

// A stream with what came of it, compared byte for byte.
struct Viewer {
  explicit Viewer(const std::string& source, const std::filesystem::path& cache = {},
                  std::uint64_t limit = 1ULL << 30) {
    SegmentStreamOptions options;
    options.network.first_retry_ms = 1;
    options.network.max_retry_ms = 3;
    options.network.give_up_after_ms = 300'000;
    options.network.jitter_seed = 3;
    options.cache_folder = cache;
    options.cache_limit_bytes = limit;
    auto opened = SegmentStream::open(source, options);
    EXPECT_TRUE(opened) << opened.error().message;
    if (!opened) return;
    stream = std::move(*opened);
    const auto head = stream->head();
    const auto index = stream->index();
    EXPECT_TRUE(head && index);
    if (!head || !index) {
      stream.reset();
      return;
    }
    EXPECT_TRUE(std::ranges::equal(*head, asset()->head()));
    EXPECT_TRUE(std::ranges::equal(*index, asset()->index()));
    auto read = read_index(*index, asset()->preamble(), *asset()->asset_head(), "the index");
    EXPECT_TRUE(read && read->unknown_pages > 0);
    if (!read) return;
    known = std::move(*read);
    EXPECT_TRUE(stream->use_index(known));
    held.assign(asset()->cell_count(), 0);
  }

  std::uint32_t next_of(std::uint32_t cell) const {
    std::uint32_t segment = held[cell];
    while (segment < asset()->segment_count(cell) && asset()->segment(cell, segment).empty()) ++segment;
    return segment;
  }
  // The runs without the cells that no page has told of yet.
  std::vector<CellRun> only_known(const std::vector<CellRun>& runs) const {
    std::vector<CellPrefix> list;
    for (const CellRun& run : runs) {
      for (std::uint32_t cell = run.first_cell; cell < run.first_cell + run.cell_count; ++cell) {
        if (known.is_known(cell)) list.push_back({cell, run.prefix});
      }
    }
    return to_runs(list);
  }
  void learn(std::uint32_t cell, std::uint32_t segment, std::span<const std::byte> bytes) {
    if (segment != known.cells[cell].segment_count) return;
    const Result<void> read = read_page(bytes, cell, *asset()->asset_head(), known, "the index");
    ASSERT_TRUE(read) << read.error().message;
    stream->learn_children(known, cell);
  }
  void want(std::vector<CellRun> runs) {
    const auto number = stream->want(std::move(runs));
    ASSERT_TRUE(number) << number.error().message;
    newest = *number;
  }
  void release(std::uint32_t cell, std::uint32_t count, std::uint32_t prefix) {
    ASSERT_TRUE(stream->release({{cell, count, prefix}}));
    for (std::uint32_t i = cell; i < cell + count; ++i) held[i] = std::min(held[i], prefix);
  }
  // Until the list is served, or so many events.
  void take(int most = 1'000'000) {
    for (int i = 0; i < most && stream->wants_outstanding(); ++i) {
      const auto event = stream->next_event(10'000);
      ASSERT_TRUE(event) << event.error().message;
      ASSERT_TRUE(*event) << "silence";
      if (const auto* s = std::get_if<event::SegmentArrived>(&**event)) {
        ASSERT_EQ(s->segment, next_of(s->cell)) << "cell " << s->cell;
        ASSERT_TRUE(std::ranges::equal(s->bytes, asset()->segment(s->cell, s->segment)));
        held[s->cell] = s->segment + 1;
        ++arrived;
        learn(s->cell, s->segment, s->bytes);
      } else if (const auto* served = std::get_if<event::WantsServed>(&**event)) {
        EXPECT_EQ(served->epoch, newest);
      } else if (const auto* off = std::get_if<event::CacheOff>(&**event)) {
        cache_off = off->reason;
      }
    }
  }
  void take_everything() {
    want({{0, asset()->cell_count(), kAllSegments}});
    take();
    for (std::uint32_t cell = 0; cell < asset()->cell_count(); ++cell) {
      ASSERT_EQ(next_of(cell), asset()->segment_count(cell)) << cell;
      ASSERT_EQ(stream->held_prefix(cell), asset()->segment_count(cell)) << cell;
    }
  }
  void look_about(std::uint64_t seed, int rounds) {
    SeededRandom random(seed);
    const std::uint32_t cells = asset()->cell_count();
    for (int round = 0; round < rounds; ++round) {
      const auto cell = static_cast<std::uint32_t>(random.below(cells));
      const auto count = static_cast<std::uint32_t>(1 + random.below(cells - cell));
      if (random.one_in(3)) release(cell, count, static_cast<std::uint32_t>(random.below(4)));
      want(only_known({{cell, count, static_cast<std::uint32_t>(random.below(9))}, {0, cells, 1}}));
      take(random.one_in(2) ? 1'000'000 : static_cast<int>(random.below(40)));
      if (::testing::Test::HasFatalFailure()) return;
    }
  }

  std::unique_ptr<SegmentStream> stream;
  AssetIndex known;
  std::vector<std::uint32_t> held;
  std::uint64_t arrived = 0;
  std::uint32_t newest = 0;
  std::string cache_off;
};

std::uint64_t segment_bytes() {
  return asset()->preamble().segment_bytes - range_table_bytes(*asset()->asset_head(), *asset()->asset_index());
}

std::string write_asset(const TemporaryFolder& folder) {
  return folder.write("model.fan", {reinterpret_cast<const char*>(asset()->bytes().data()), asset()->bytes().size()})
      .string();
}

class SegmentStreamTest : public ::testing::Test {
 protected:
  SegmentStreamTest() { server.add("model", asset()); }
  std::string source() const { return server.address() + "/model"; }
  TemporaryFolder folder;
  std::filesystem::path cache = folder.path() / "cache";
  ModelServer server;
};

TEST_F(SegmentStreamTest, AFileAServerAndACacheGiveTheSame) {
  RepeatedlyCuttingRelay relay(server.port(), [](unsigned n) { return 7'000 + 501 * n; });
  const std::string cut = "127.0.0.1:" + std::to_string(relay.port()) + "/model";
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    Viewer viewers[] = {Viewer(write_asset(folder)), Viewer(source()), Viewer(source(), cache),
                        Viewer(source(), folder.path() / "small", 9'000)};
    for (Viewer& viewer : viewers) {
      ASSERT_TRUE(viewer.stream);
      viewer.look_about(seed, 40);
      viewer.take_everything();
      ASSERT_FALSE(HasFatalFailure());
    }
    EXPECT_EQ(viewers[3].cache_off, "") << "a cache that is full is no reason to stop using it";
  }
  for (const std::filesystem::path& with : {std::filesystem::path(), folder.path() / "cut"}) {
    Viewer viewer(cut, with);
    ASSERT_TRUE(viewer.stream);
    viewer.look_about(9, 40);
    viewer.take_everything();
  }
  EXPECT_GT(relay.connections(), 2U);
}

TEST_F(SegmentStreamTest, WhatIsCachedIsNeverFetchedAgain) {
  {
    Viewer first(source(), cache);
    ASSERT_TRUE(first.stream);
    first.take_everything();
    EXPECT_EQ(first.stream->cached_bytes(), 0U);
    const std::uint64_t fetched = first.stream->received_bytes();
    first.release(0, asset()->cell_count(), 0);
    first.take_everything();
    EXPECT_EQ(first.stream->cached_bytes(), segment_bytes());
    EXPECT_LT(first.stream->received_bytes(), fetched + 100);
  }
  Viewer second(source(), cache);
  ASSERT_TRUE(second.stream);
  second.take_everything();
  EXPECT_EQ(second.stream->cached_bytes(), segment_bytes());
  EXPECT_LT(second.stream->received_bytes(), 200U);
}

TEST_F(SegmentStreamTest, TheSameAssetFromAnotherServerIsFoundInTheCache) {
  Viewer(source(), cache).take_everything();
  ModelServer other;
  other.add("renamed", asset());
  Viewer viewer(other.address() + "/renamed", cache);
  ASSERT_TRUE(viewer.stream);
  viewer.take_everything();
  EXPECT_EQ(viewer.stream->cached_bytes(), segment_bytes());
}

TEST_F(SegmentStreamTest, DamageInTheCacheIsFetchedAgain) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    Viewer(source(), cache).take_everything();
    for (const auto& entry : std::filesystem::directory_iterator(cache)) {
      if (entry.path().extension() != ".fancache") continue;
      SeededRandom random(seed);
      std::fstream file(entry.path(), std::ios::binary | std::ios::in | std::ios::out);
      for (int i = 0; i < 20; ++i) {
        // Contents more than headers: what follows a damaged header is cut off.
        file.seekp(static_cast<std::streamoff>(seed % 3 == 0 ? random.below(entry.file_size())
                                                             : entry.file_size() - 1 - random.below(300)));
        file.put(static_cast<char>(random.below(256)));
      }
    }
    Viewer viewer(source(), cache);
    ASSERT_TRUE(viewer.stream);
    viewer.look_about(seed, 10);
    viewer.take_everything();
  }
}

TEST_F(SegmentStreamTest, ASecondStreamOfTheAssetGoesOnWithoutTheCacheAndSaysSo) {
  Viewer first(source(), cache);
  ASSERT_TRUE(first.stream);
  first.want({{0, asset()->cell_count(), 2}});
  first.take();
  Viewer second(source(), cache);
  ASSERT_TRUE(second.stream);
  second.take_everything();
  EXPECT_NE(second.cache_off.find("another process"), std::string::npos) << second.cache_off;
  first.take_everything();
  EXPECT_EQ(first.cache_off, "");
}

TEST_F(SegmentStreamTest, ACacheThatCannotBeUsedIsSaidAndDoneWithout) {
  folder.write("file", "text");
  Viewer viewer(source(), folder.path() / "file");
  ASSERT_TRUE(viewer.stream);
  viewer.take_everything();
  EXPECT_NE(viewer.cache_off.find("cannot make the folder"), std::string::npos) << viewer.cache_off;
}

TEST_F(SegmentStreamTest, AModelThatWasReplacedSinceIsStreamedAsItIsNow) {
  const auto old = testing::build_model(testing::make_sphere(20, 30));
  {
    auto opened = SegmentCache::open(cache, 1ULL << 30);
    ASSERT_TRUE(opened);
    ASSERT_TRUE((*opened)->remember(source(), old->digest()));
    ASSERT_TRUE((*opened)->begin(old->digest()));
    ASSERT_TRUE((*opened)->put_head(old->head()).value_or(false));
    ASSERT_TRUE((*opened)->put_index(old->index()).value_or(false));
    ASSERT_TRUE((*opened)->append(0, 0, old->segment(0, 0)).value_or(false));
  }
  for (int time = 0; time < 2; ++time) {
    Viewer viewer(source(), cache);
    ASSERT_TRUE(viewer.stream);
    viewer.take_everything();
    EXPECT_EQ(viewer.cache_off, "");
    EXPECT_EQ(viewer.stream->cached_bytes(), time == 0 ? 0 : segment_bytes());
  }
}

TEST_F(SegmentStreamTest, CellsThatTheModelHasNotAreNamed) {
  for (const std::string& from : {write_asset(folder), source()}) {
    Viewer viewer(from);
    ASSERT_TRUE(viewer.stream);
    const auto wanted = viewer.stream->want({{asset()->cell_count() - 1, 2, 1}});
    ASSERT_FALSE(wanted);
    EXPECT_NE(wanted.error().message.find("cell " + std::to_string(asset()->cell_count())), std::string::npos);
    EXPECT_FALSE(viewer.stream->release({{asset()->cell_count(), 1, 0}}));
    viewer.take_everything();
  }
}

// What a view drops when the camera jumps may be more than one frame can tell.
TEST_F(SegmentStreamTest, AReleaseMayHaveAnyNumberOfRuns) {
  const std::vector<CellRun> runs(kMaxRuns + 1, CellRun{1, 2, 0});
  for (const auto& [from, with] :
       {std::pair<std::string, std::filesystem::path>(write_asset(folder), {}), {source(), {}}, {source(), cache}}) {
    Viewer viewer(from, with);
    ASSERT_TRUE(viewer.stream);
    viewer.take_everything();
    const Result<void> released = viewer.stream->release(runs);
    ASSERT_TRUE(released) << released.error().message;
    viewer.held[1] = viewer.held[2] = 0;
    viewer.take_everything();
  }
}

TEST_F(SegmentStreamTest, PollingWithoutTimeNeverWaits) {
  for (const std::string& from : {write_asset(folder), source()}) {
    Viewer viewer(from);
    ASSERT_TRUE(viewer.stream);
    viewer.take_everything();
    for (int i = 0; i < 100; ++i) {
      const auto event = viewer.stream->next_event(0);
      ASSERT_TRUE(event);
      EXPECT_FALSE(*event);
    }
  }
}

TEST_F(SegmentStreamTest, TheStopFlagEndsIt) {
  for (const std::string& from : {write_asset(folder), source()}) {
    std::atomic<bool> stop{false};
    SegmentStreamOptions options;
    options.network.client.stop = &stop;
    auto stream = SegmentStream::open(from, options);
    ASSERT_TRUE(stream);
    stop = true;
    const auto event = (*stream)->next_event(1'000'000'000);
    ASSERT_FALSE(event);
    EXPECT_EQ(event.error().kind, ErrorKind::interrupted);
  }
}

}  // namespace
}  // namespace fanstream
