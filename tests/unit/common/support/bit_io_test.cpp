#include "common/support/bit_io.h"

#include <gtest/gtest.h>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::SeededRandom;

TEST(BitIo, BitsComeBackBetweenBytes) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    std::vector<std::pair<int, std::uint32_t>> numbers;
    for (std::uint32_t i = random.below(40); i > 0; --i) {
      const auto count = static_cast<int>(random.below(20));
      numbers.emplace_back(count, random.below(std::size_t{1} << count));
    }
    ByteWriter out;
    out.u8(7);
    BitWriter bits(out);
    std::size_t total = 0;
    for (const auto& [count, value] : numbers) {
      bits.bits(count, value);
      total += static_cast<std::size_t>(count);
    }
    bits.finish();
    out.u8(9);
    ASSERT_EQ(out.size(), 2 + (total + 7) / 8);
    ByteReader in(out.view());
    EXPECT_EQ(in.u8(), 7);
    BitReader read(in);
    for (const auto& [count, value] : numbers) ASSERT_EQ(read.bits(count), value);
    EXPECT_EQ(in.u8(), 9);
    EXPECT_FALSE(in.failed());
  }
}

TEST(BitIo, ReadingPastTheEndFails) {
  ByteWriter out;
  out.u8(0xFF);
  ByteReader in(out.view());
  BitReader read(in);
  EXPECT_EQ(read.bits(8), 0xFFU);
  EXPECT_FALSE(in.failed());
  EXPECT_FALSE(read.bit());
  EXPECT_TRUE(read.bytes().failed());
}

}  // namespace
}  // namespace fanstream
