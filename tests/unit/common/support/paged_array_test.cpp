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
