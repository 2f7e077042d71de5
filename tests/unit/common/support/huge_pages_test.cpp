#include "common/support/huge_pages.h"

#include <gtest/gtest.h>

#include <numeric>

namespace fanstream {
namespace {

TEST(HugePages, AResizedArrayKeepsWhatItHeldAndEndsInFreshElements) {
  std::vector<std::uint32_t> array(1000);
  std::iota(array.begin(), array.end(), 1U);
  for (const std::size_t size : {std::size_t{1001}, std::size_t{3} << 20U, std::size_t{5} << 20U, std::size_t{7}}) {
    resize_large(array, size);
    ASSERT_EQ(array.size(), size);
    for (std::size_t i = 0; i < size; ++i) ASSERT_EQ(array[i], i < 1000 ? i + 1 : 0U) << "of " << size;
  }
}

TEST(HugePages, AnyRangeCanBeAskedFor) {
  prefer_huge_pages(nullptr, 0);
  const std::vector<std::byte> memory(std::size_t{9} << 20U);
  for (const std::size_t offset : {0U, 1U, 4096U, 2U << 20U}) {
    prefer_huge_pages(memory.data() + offset, memory.size() - offset);
    prefer_huge_pages(memory.data() + offset, 100);
  }
  EXPECT_EQ(memory[12345], std::byte{0});
}

}  // namespace
}  // namespace fanstream
