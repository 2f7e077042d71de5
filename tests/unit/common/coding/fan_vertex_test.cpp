#include "common/coding/fan_vertex.h"

#include <gtest/gtest.h>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

TEST(VertexContext, IsANumberAndBack) {
  for (std::uint32_t touched = 0; touched <= kMostGenerations; ++touched) {
    for (const std::uint32_t next : {0U, 1U, 37U, kMostGenerations, std::uint32_t{kNeverSplit}}) {
      const VertexContext context = VertexContext::of_word(VertexContext::word_of(touched, next));
      EXPECT_EQ(context.touched, touched);
      EXPECT_EQ(context.next, next);
      EXPECT_EQ(context.word(), VertexContext::word_of(touched, next));
    }
  }
}

TEST(FanVertex, HasThePlaceAndContextThatItIsSetTo) {
  testing::SeededRandom random(3);
  for (int i = 0; i < 1000; ++i) {
    const auto coordinate = [&] { return random.between(-(1 << 22), 1 << 22); };
    const GridPoint place(coordinate(), coordinate(), coordinate());
    Int4 lanes = int4(place);
    lanes[3] = coordinate();  // of no meaning
    const std::uint32_t touched = random.below(kMostGenerations + 1);
    const std::uint32_t next = random.below(256);
    FanVertex vertex{{1, 2, 3}, {4, 5, 0}};
    vertex.set(lanes, VertexContext::word_of(touched, next));
    ASSERT_EQ(vertex.place, place);
    ASSERT_EQ(vertex.context.touched, touched);
    ASSERT_EQ(vertex.context.next, next);
    ASSERT_EQ(vertex.context.unused, 0);
    ASSERT_EQ(to_ivec3(vertex.place4()), place);
    ASSERT_GE(vertex.place4()[3], 0);
  }
}

}  // namespace
}  // namespace fanstream
