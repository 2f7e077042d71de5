// Whatever happens to its files, the cache gives back exactly what was put in, or says that it has not.
#include "client/cache/segment_cache.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <map>
#include <random>

#include "tests/support/temporary_folder.h"

namespace fanstream {
namespace {

namespace fs = std::filesystem;
using testing::TemporaryFolder;
using Content = std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::byte>>;

constexpr Digest kDigest = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
constexpr std::uint64_t kPlenty = 1ULL << 30;

std::vector<std::byte> bytes_of(std::size_t size, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<std::byte> bytes(size);
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
  return bytes;
}

Content some_segments(std::uint32_t count) {
  Content content;
  for (std::uint32_t i = 0; i < count; ++i) content[{i % 7, i / 7}] = bytes_of(1 + i * 13 % 60, i);
  return content;
}

std::unique_ptr<SegmentCache> open_cache(const fs::path& folder, std::uint64_t limit_bytes = kPlenty,
                                         const Digest& digest = kDigest) {
  auto cache = SegmentCache::open(folder, limit_bytes);
  EXPECT_TRUE(cache) << cache.error().message;
  if (!cache) return nullptr;
  const auto begun = (*cache)->begin(digest);
  EXPECT_TRUE(begun) << begun.error().message;
  return std::move(*cache);
}

void fill(SegmentCache& cache, const Content& content) {
  ASSERT_TRUE(cache.put_head(bytes_of(60, 1000)).value_or(false));
  ASSERT_TRUE(cache.put_index(bytes_of(40, 1001)).value_or(false));
  for (const auto& [place, bytes] : content)
    ASSERT_TRUE(cache.append(place.first, place.second, bytes).value_or(false));
}

// How many of them it holds; each of those is exact.
std::size_t held_exactly(SegmentCache& cache, const Content& content) {
  std::size_t held = 0;
  for (const auto& [place, bytes] : content) {
    const auto found = cache.read(place.first, place.second);
    if (!found) continue;
    ++held;
    EXPECT_TRUE(std::ranges::equal(*found, bytes)) << place.first << " " << place.second;
  }
  if (const auto head = cache.head()) {
    EXPECT_EQ(*head, bytes_of(60, 1000));
  }
  if (const auto index = cache.index()) {
    EXPECT_EQ(*index, bytes_of(40, 1001));
  }
  return held;
}

fs::path file_in(const fs::path& folder) {
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".fancache") return entry.path();
  }
  return {};
}

std::string contents(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void overwrite(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

TEST(SegmentCache, WhatWasPutInComesBackNowAndLater) {
  const TemporaryFolder folder;
  const Content content = some_segments(5000);  // more than is held back before it is written
  {
    const auto cache = open_cache(folder.path() / "made" / "anew");
    ASSERT_TRUE(cache);
    EXPECT_FALSE(cache->head());
    EXPECT_FALSE(cache->holds(0, 0));
    fill(*cache, content);
    EXPECT_EQ(held_exactly(*cache, content), content.size());
  }
  const auto cache = open_cache(folder.path() / "made" / "anew");
  EXPECT_EQ(cache->cut_bytes(), 0U);
  EXPECT_TRUE(cache->head() && cache->index());
  EXPECT_EQ(held_exactly(*cache, content), content.size());
  EXPECT_FALSE(cache->holds(0, 100'000));
  EXPECT_FALSE(cache->holds(100'000, 0));
  EXPECT_EQ(cache->dropped_records(), 0U);
}

TEST(SegmentCache, AssetsDoNotMix) {
  const TemporaryFolder folder;
  const auto cache = open_cache(folder.path());
  fill(*cache, some_segments(10));
  Digest other = kDigest;
  other[0] = 99;
  ASSERT_TRUE(cache->begin(other));
  EXPECT_FALSE(cache->head());
  EXPECT_EQ(held_exactly(*cache, some_segments(10)), 0U);
  ASSERT_TRUE(cache->begin(kDigest));
  EXPECT_EQ(held_exactly(*cache, some_segments(10)), 10U);
}

TEST(SegmentCache, CutAtEveryByteItHoldsWhatIsWholeAndTakesTheRestAnew) {
  const TemporaryFolder folder;
  const Content content = some_segments(10);
  fill(*open_cache(folder.path()), content);
  const fs::path path = file_in(folder.path());
  const std::string whole = contents(path);
  std::size_t held_before = 0;
  for (std::size_t size = 0; size <= whole.size(); ++size) {
    overwrite(path, whole.substr(0, size));
    {
      const auto cache = open_cache(folder.path());
      ASSERT_TRUE(cache);
      const std::size_t held = held_exactly(*cache, content);
      ASSERT_GE(held, held_before) << size;
      ASSERT_EQ(cache->dropped_records(), 0U) << "only the end is missing";
      held_before = held;
      for (const auto& [place, bytes] : content) {
        if (!cache->holds(place.first, place.second)) {
          ASSERT_TRUE(cache->append(place.first, place.second, bytes).value_or(false));
        }
      }
    }
    ASSERT_EQ(held_exactly(*open_cache(folder.path()), content), content.size()) << size;
  }
  EXPECT_EQ(held_before, content.size());
}

TEST(SegmentCache, AFlippedBitIsNeverGivenOutAndCostsAtMostWhatFollowsIt) {
  const TemporaryFolder folder;
  const Content content = some_segments(8);
  fill(*open_cache(folder.path()), content);
  const fs::path path = file_in(folder.path());
  const std::string whole = contents(path);
  std::size_t lost = 0;
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << (at % 8)));
    overwrite(path, damaged);
    const auto cache = open_cache(folder.path());
    ASSERT_TRUE(cache);
    const std::size_t held = held_exactly(*cache, content);
    const bool all = held == content.size() && cache->head() && cache->index();
    ASSERT_FALSE(all) << "the bit at byte " << at << " is part of something";
    lost += content.size() - held;
    for (const auto& [place, bytes] : content)
      ASSERT_TRUE(cache->append(place.first, place.second, bytes).value_or(false));
    ASSERT_EQ(held_exactly(*cache, content), content.size());
  }
  EXPECT_GT(lost, 0U);
}

TEST(SegmentCache, RandomDamageOfManyBytesIsSurvived) {
  const TemporaryFolder folder;
  const Content content = some_segments(200);
  fill(*open_cache(folder.path()), content);
  const fs::path path = file_in(folder.path());
  const std::string whole = contents(path);
  for (std::uint32_t seed = 0; seed < 80; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::string damaged = whole;
    for (std::uint32_t i = 0; i < 1 + seed % 5; ++i) {
      const std::size_t at = random() % damaged.size();
      switch (random() % 4) {
        case 0: damaged[at] = static_cast<char>(random()); break;
        case 1: damaged.erase(at, random() % 100); break;
        case 2: damaged.insert(at, std::string(random() % 100, static_cast<char>(random()))); break;
        case 3: std::memset(damaged.data() + at, 0, std::min<std::size_t>(random() % 4096, damaged.size() - at)); break;
      }
    }
    overwrite(path, damaged);
    const auto cache = open_cache(folder.path());
    ASSERT_TRUE(cache);
    (void)held_exactly(*cache, content);
    for (const auto& [place, bytes] : content)
      ASSERT_TRUE(cache->append(place.first, place.second, bytes).value_or(false));
    ASSERT_EQ(held_exactly(*cache, content), content.size());
  }
}

TEST(SegmentCache, AFileOfGarbageBeginsAnew) {
  const TemporaryFolder folder;
  fill(*open_cache(folder.path()), some_segments(5));
  const fs::path path = file_in(folder.path());
  for (const std::string& garbage : {std::string("x"), std::string(100'000, '\xff'), std::string(5000, '\0')}) {
    overwrite(path, garbage);
    const auto cache = open_cache(folder.path());
    ASSERT_TRUE(cache);
    EXPECT_EQ(cache->cut_bytes(), garbage.size());
    EXPECT_EQ(held_exactly(*cache, some_segments(5)), 0U);
    EXPECT_TRUE(cache->append(0, 0, bytes_of(10, 0)).value_or(false));
  }
}

TEST(SegmentCache, ASecondProcessIsToldThatTheAssetIsInUse) {
  const TemporaryFolder folder;
  const auto first = open_cache(folder.path());
  fill(*first, some_segments(10));
  auto second = SegmentCache::open(folder.path(), kPlenty);
  ASSERT_TRUE(second);
  const auto begun = (*second)->begin(kDigest);
  ASSERT_FALSE(begun);
  EXPECT_EQ(begun.error().kind, ErrorKind::limit);
  EXPECT_NE(begun.error().message.find("another process"), std::string::npos) << begun.error().message;
  EXPECT_FALSE((*second)->begun());
  Digest other = kDigest;
  other[3] = 77;
  EXPECT_TRUE((*second)->begin(other)) << "another asset is free";
}

TEST(SegmentCache, TheAssetsUsedLongestAgoMakeRoomForNewOnes) {
  const TemporaryFolder folder;
  Digest digest = kDigest;
  for (std::uint8_t i = 0; i < 5; ++i) {
    digest[0] = i;
    const auto cache = open_cache(folder.path(), 25'000, digest);
    ASSERT_TRUE(cache->append(0, 0, bytes_of(8'000, i)).value_or(false));
    ASSERT_TRUE(cache->flush());
    // An hour apart, so that no clock has to tick; the file is marked as used when it is opened.
    for (const auto& entry : fs::directory_iterator(folder.path()))
      fs::last_write_time(entry.path(), fs::last_write_time(entry.path()) - std::chrono::hours(1));
  }
  std::uint64_t total = 0;
  for (const auto& entry : fs::directory_iterator(folder.path())) total += entry.file_size();
  EXPECT_LE(total, 25'000U);
  const auto holds = [&](std::uint8_t number) {
    digest[0] = number;
    return open_cache(folder.path(), kPlenty, digest)->holds(0, 0);
  };
  EXPECT_FALSE(holds(0));
  EXPECT_FALSE(holds(1));
  EXPECT_TRUE(holds(2) && holds(3) && holds(4));
}

std::uint64_t bytes_in(const fs::path& folder) {
  std::uint64_t sum = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".fancache") sum += entry.file_size();
  }
  return sum;
}

TEST(SegmentCache, SeveralThatAreWrittenAtOnceKeepTheLimitTogether) {
  const TemporaryFolder folder;
  constexpr std::uint64_t kLimitBytes = 600'000;
  std::vector<std::unique_ptr<SegmentCache>> caches;
  for (std::uint8_t i = 0; i < 4; ++i) {
    Digest digest = kDigest;
    digest[0] = i;
    caches.push_back(open_cache(folder.path(), kLimitBytes, digest));
    ASSERT_TRUE(caches.back());
  }
  std::vector<Content> kept(caches.size());
  for (std::uint32_t round = 0; round < 40; ++round) {
    for (std::size_t i = 0; i < caches.size(); ++i) {
      const std::vector<std::byte> bytes = bytes_of(9'000, round);
      if (caches[i]->append(1, round, bytes).value_or(false)) kept[i][{1, round}] = bytes;
    }
    ASSERT_LE(bytes_in(folder.path()), kLimitBytes) << "round " << round;
  }
  for (std::size_t i = 0; i < caches.size(); ++i) {
    EXPECT_TRUE(caches[i]->flush());
    EXPECT_GE(held_exactly(*caches[i], kept[i]), 7U) << "what was written before is still held";
  }
  caches.clear();
  EXPECT_LE(bytes_in(folder.path()), kLimitBytes);
  EXPECT_GE(bytes_in(folder.path()), kLimitBytes * 3 / 4) << "and it is used";
}

TEST(SegmentCache, AnAssetAloneLargerThanTheLimitIsKeptAsFarAsItFits) {
  const TemporaryFolder folder;
  const auto cache = open_cache(folder.path(), 1'000);
  ASSERT_TRUE(cache->append(0, 0, bytes_of(500, 1)).value_or(false));
  const auto second = cache->append(0, 1, bytes_of(500, 2));
  ASSERT_TRUE(second);
  EXPECT_FALSE(*second);
  EXPECT_TRUE(cache->read(0, 0));
  EXPECT_FALSE(cache->holds(0, 1));
}

TEST(SegmentCache, AnAssetInUseIsNotRemoved) {
  const TemporaryFolder folder;
  const auto in_use = open_cache(folder.path());
  ASSERT_TRUE(in_use->append(0, 0, bytes_of(5'000, 1)).value_or(false));
  ASSERT_TRUE(in_use->flush());
  Digest other = kDigest;
  other[0] = 9;
  const auto cache = open_cache(folder.path(), 8'000, other);
  const auto put = cache->append(0, 0, bytes_of(5'000, 2));
  ASSERT_TRUE(put);
  EXPECT_FALSE(*put);
  EXPECT_TRUE(in_use->read(0, 0));
}

TEST(SegmentCache, FoldersThatCannotBeUsedAreNamed) {
  const TemporaryFolder folder;
  folder.write("file", "text");
  const auto beneath_a_file = SegmentCache::open(folder.path() / "file" / "cache", kPlenty);
  ASSERT_FALSE(beneath_a_file);
  EXPECT_EQ(beneath_a_file.error().kind, ErrorKind::io);
  EXPECT_NE(beneath_a_file.error().message.find((folder.path() / "file" / "cache").string()), std::string::npos);
  const auto a_file = SegmentCache::open(folder.path() / "file", kPlenty);
  ASSERT_FALSE(a_file);
}

TEST(SegmentCache, AFolderWithoutPermissionIsNamed) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may write anywhere";
  const TemporaryFolder folder;
  fs::create_directory(folder.path() / "locked");
  fs::permissions(folder.path() / "locked", fs::perms::owner_read | fs::perms::owner_exec);
  EXPECT_FALSE(SegmentCache::open(folder.path() / "locked", kPlenty));
}

// In a process of its own: the limit on the size of files stands for a full disk.
TEST(SegmentCache, AFullDiskIsAnErrorAndWhatWasHeldStays) {
  const TemporaryFolder folder;
  const Content content = some_segments(20);
  fill(*open_cache(folder.path()), content);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{20'000, 20'000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    auto cache = SegmentCache::open(folder.path(), kPlenty);
    if (!cache || !(*cache)->begin(kDigest)) ::_exit(10);
    if (!(*cache)->append(50, 0, bytes_of(30'000, 1)).value_or(false)) ::_exit(11);  // only held back so far
    const auto flushed = (*cache)->flush();
    if (flushed || flushed.error().kind != ErrorKind::io) ::_exit(12);
    if ((*cache)->holds(50, 0)) ::_exit(13);
    if (held_exactly(**cache, content) != content.size()) ::_exit(14);
    if (!(*cache)->append(50, 1, bytes_of(100, 2)).value_or(false) || !(*cache)->flush()) ::_exit(15);
    ::_exit(0);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
  const auto cache = open_cache(folder.path());
  EXPECT_EQ(cache->cut_bytes(), 0U);
  EXPECT_EQ(held_exactly(*cache, content), content.size());
  EXPECT_TRUE(cache->holds(50, 1));
}

TEST(SegmentCache, ASourceIsRememberedByItsAsset) {
  const TemporaryFolder folder;
  const auto cache = open_cache(folder.path());
  EXPECT_FALSE(cache->recall("localhost:7370/bunny"));
  ASSERT_TRUE(cache->remember("localhost:7370/bunny", kDigest));
  EXPECT_EQ(cache->recall("localhost:7370/bunny"), kDigest);
  EXPECT_FALSE(cache->recall("localhost:7370/bunny2"));
  Digest other = kDigest;
  other[0] = 5;
  ASSERT_TRUE(cache->remember("localhost:7370/bunny", other));
  EXPECT_EQ(cache->recall("localhost:7370/bunny"), other);
  for (const auto& entry : fs::directory_iterator(folder.path())) {
    if (entry.path().extension() == ".source") overwrite(entry.path(), contents(entry.path()).substr(0, 20));
  }
  EXPECT_FALSE(cache->recall("localhost:7370/bunny"));
}

}  // namespace
}  // namespace fanstream
