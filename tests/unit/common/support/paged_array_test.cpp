#include "common/support/paged_array.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "tests/support/seeded_random.h"

#if defined(__linux__)
#include <sys/mman.h>
#include <unistd.h>
#endif

namespace fanstream {
namespace {

TEST(PagedArray, GrowsWithWhatItHeldAndEndsInZeros) {
  for (const PageKind kind : {PageKind::small, PageKind::huge}) {
    std::vector<std::uint32_t> values(1000);
    std::iota(values.begin(), values.end(), 1U);
    PagedArray<std::uint32_t> array(values);
    for (const std::size_t size : {std::size_t{1001}, std::size_t{3} << 20U, std::size_t{7}}) {
      array.grow(size, kind);
      ASSERT_EQ(array.size(), std::max<std::size_t>(size, size == 7 ? 3U << 20U : 0U)) << "it only grows";
      ASSERT_EQ(reinterpret_cast<std::uintptr_t>(array.data()) % 16, 0U);
      for (std::size_t i = 0; i < array.size(); ++i) ASSERT_EQ(array[i], i < 1000 ? i + 1 : 0U) << "of " << size;
    }
    const PagedArray<std::uint32_t> copy = array;
    array[5] = 0;
    EXPECT_EQ(copy[5], 6U);
    EXPECT_EQ(copy.size(), array.size());
    PagedArray<std::uint32_t> moved = std::move(array);
    EXPECT_EQ(moved[6], 7U);
    EXPECT_EQ(moved.end() - moved.begin(), 3 << 20);
  }
  EXPECT_EQ(PagedArray<int>().size(), 0U);
}

#if defined(__linux__)
std::size_t pages_present(const void* data, std::size_t size_bytes) {
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  std::vector<unsigned char> present((size_bytes + page - 1) / page);
  if (mincore(const_cast<void*>(data), size_bytes, present.data()) != 0) ADD_FAILURE() << "mincore";
  return static_cast<std::size_t>(
      std::count_if(present.begin(), present.end(), [](unsigned char p) { return (p & 1U) != 0; }));
}

// Random writes and discards: what lies outside of a discarded range stays, what is counted is what is there.
TEST(PagedArray, TakesMemoryForTheSmallPagesInUseAlone) {
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    testing::SeededRandom random(seed);
    PagedArray<std::uint64_t> array;
    array.grow(100 * page / 8 + random.below(page / 8), PageKind::small);
    EXPECT_EQ(array.resident_bytes(), 0U);
    std::vector<std::uint64_t> expected(array.size());
    std::vector<bool> known(array.size(), true);
    for (int step = 0; step < 60; ++step) {
      const std::size_t first = random.below(array.size());
      const std::size_t last = first + random.below(std::min<std::size_t>(array.size() - first, 9000)) + 1;
      if (random.one_in(2)) {
        array.note_use(first, last);
        for (std::size_t i = first; i < last; ++i) {
          array[i] = expected[i] = i + 1;
          known[i] = true;
        }
      } else {
        array.discard(first, last);
        for (std::size_t i = first; i < last; ++i) known[i] = false;
      }
      ASSERT_EQ(array.resident_bytes(), pages_present(array.data(), array.size() * 8) * page) << "step " << step;
    }
    for (std::size_t i = 0; i < array.size(); ++i) {
      ASSERT_TRUE(known[i] ? array[i] == expected[i] : array[i] == expected[i] || array[i] == 0) << i;
    }
    array.discard(0, array.size());
    EXPECT_EQ(array.resident_bytes(), 0U);
  }
}

// Where there are huge pages, as long as anything of them is in use without a page of it given back; else small ones.
TEST(PagedArray, TakesMoreMemoryThanIsInUseOfLargeArraysAlone) {
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  constexpr std::size_t kHuge = ZeroPages::kHugePageBytes;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    testing::SeededRandom random(seed);
    PagedArray<std::uint64_t> array;
    array.grow((5 * kHuge + random.below(kHuge)) / 8, PageKind::small);
    std::vector<bool> used((array.size() * 8 + page - 1) / page);
    const auto pages_of = [&](bool in_use) {
      return static_cast<std::size_t>(std::count(used.begin(), used.end(), in_use));
    };
    const auto use = [&](std::size_t p) {
      const std::size_t first = p * page / 8;
      const std::size_t last = std::min(array.size(), first + page / 8);
      array.note_use(first, last);
      for (std::size_t i = first; i < last; ++i) array[i] = i + 1;
      used[p] = true;
    };
    const auto check = [&] {
      const std::size_t present = pages_present(array.data(), array.size() * 8);
      ASSERT_GE(present, pages_of(true));
      ASSERT_LE(present * page, array.resident_bytes());
      ASSERT_LE(array.resident_bytes(), std::max(pages_of(true) * page, ZeroPages::kSmallBytes + 4 * kHuge));
      for (std::size_t p = 0; p < used.size(); ++p) {
        if (used[p]) {
          ASSERT_EQ(array[p * page / 8], p * page / 8 + 1) << "page " << p;
        }
      }
    };
    for (std::size_t p = 0; p * page < ZeroPages::kSmallBytes; ++p) use(p);
    ASSERT_EQ(array.resident_bytes(), ZeroPages::kSmallBytes) << "small pages so far";
    for (std::size_t p = ZeroPages::kSmallBytes / page; p < used.size(); p += 1 + random.below(300)) use(p);
    check();
    for (int step = 0; step < 40; ++step) {
      const std::size_t first = random.below(used.size());
      const std::size_t last = std::min(used.size(), first + 1 + random.below(400));
      array.discard(first * page / 8, std::min(array.size(), last * page / 8));
      std::fill(used.begin() + static_cast<std::ptrdiff_t>(first), used.begin() + static_cast<std::ptrdiff_t>(last),
                false);
      for (std::uint32_t n = random.below(4); n > 0; --n) use(random.below(used.size()));
      check();
    }
    array.discard(0, array.size());
    EXPECT_EQ(array.resident_bytes(), 0U);
    EXPECT_EQ(pages_present(array.data(), array.size() * 8), 0U);
  }
}
#endif

TEST(PagedArray, HugePagesAreKept) {
  PagedArray<std::uint64_t> array;
  array.grow(100'000, PageKind::huge);
  EXPECT_EQ(array.resident_bytes(), 800'000U);
  array[50'000] = 3;
  array.discard(0, array.size());
  EXPECT_EQ(array[50'000], 3U);
  EXPECT_EQ(array.resident_bytes(), 800'000U);
}

}  // namespace
}  // namespace fanstream
