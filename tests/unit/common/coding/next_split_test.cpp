#include "common/coding/next_split.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "common/fans/linked_fans.h"
#include "tests/support/exact_bytes.h"
#include "tests/support/seeded_random.h"
#include "tests/unit/common/fans/fan_shapes.h"

namespace fanstream {
namespace {

using testing::ExactBytes;
using testing::fan_shapes;
using testing::SeededRandom;

constexpr NextSplitOf kAll[] = {NextSplitOf::root, NextSplitOf::added, NextSplitOf::base};

// The same by lists: the generations of now..last that are not excluded, ascending.
struct Case {
  std::uint32_t now;
  std::uint32_t last;
  std::vector<std::uint32_t> excluded;

  explicit Case(SeededRandom& random) : now(0), last(1 + random.below(kMostGenerations)) {
    now = 1 + random.below(last);
    for (std::uint32_t i = random.below(random.one_in(3) ? 80 : 9); i > 0; --i) {
      // Neighbours' next splits, some never, some (in damaged data) before now.
      excluded.push_back(random.one_in(4) ? kNeverSplit : 1 + random.below(last));
    }
  }
  std::vector<std::uint32_t> expected() const {
    std::vector<std::uint32_t> free;
    for (std::uint32_t g = now; g <= last; ++g) {
      if (std::find(excluded.begin(), excluded.end(), g) == excluded.end()) free.push_back(g);
    }
    return free;
  }
  FreeGenerations free() const {
    FreeGenerations result(now, last);
    for (const std::uint32_t g : excluded) result.exclude(g);
    return result;
  }
};

std::vector<std::byte> noise(SeededRandom& random, std::size_t most) {
  std::vector<std::byte> bytes(random.below(most));
  for (std::byte& b : bytes) b = static_cast<std::byte>(random.below(256));
  return bytes;
}

TEST(NextSplit, RanksAndGenerationsAreInverse) {
  for (std::uint64_t seed = 0; seed < 3000; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const Case c(random);
    const std::vector<std::uint32_t> expected = c.expected();
    const FreeGenerations free = c.free();
    ASSERT_EQ(free.count(), expected.size());
    for (std::uint32_t rank = 0; rank < expected.size(); ++rank) {
      ASSERT_EQ(free.of_rank(rank), expected[rank]);
      ASSERT_EQ(free.rank_of(expected[rank]), rank);
    }
    const bool taken = std::find(c.excluded.begin(), c.excluded.end(), c.now + 1) != c.excluded.end();
    ASSERT_EQ(free.next_is_taken(), taken);
  }
}

TEST(NextSplit, AllSixtyFourGenerationsCanBeCounted) {
  FreeGenerations all(1, kMostGenerations);
  EXPECT_EQ(all.count(), 64U);
  EXPECT_EQ(all.of_rank(63), 64U);
  EXPECT_EQ(all.rank_of(64), 63U);
  for (std::uint32_t g = 1; g <= 64; ++g) all.exclude(g);
  EXPECT_EQ(all.count(), 0U);
  FreeGenerations last(64, 64);
  EXPECT_EQ(last.count(), 1U);
  last.exclude_set(1);
  EXPECT_EQ(last.count(), 0U);
}

TEST(NextSplit, SetsOfBitsExcludeWhatSingleGenerationsDo) {
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const Case c(random);
    std::uint64_t set = 0;
    for (const std::uint32_t g : c.excluded) set |= FreeGenerations::bit(g, c.now);
    FreeGenerations free(c.now, c.last);
    free.exclude_set(set);
    ASSERT_EQ(free.count(), c.free().count());
    for (std::uint32_t rank = 0; rank < free.count(); ++rank) ASSERT_EQ(free.of_rank(rank), c.free().of_rank(rank));
  }
}

TEST(NextSplit, EveryChoiceComesBack) {
  const SplitModel model;
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    struct Coded {
      NextSplitOf whose;
      std::uint32_t valence;
      FreeGenerations free;
      std::uint8_t generation;
    };
    std::vector<Coded> all;
    for (int i = 0; i < 40; ++i) {
      const Case c(random);
      const std::uint32_t valence = 3 + random.below(20);
      const NextSplitOf whose = kAll[random.below(3)];
      all.push_back({whose, valence, c.free(), kNeverSplit});
      for (const std::uint32_t g : c.expected()) {
        all.push_back({whose, valence, c.free(), static_cast<std::uint8_t>(g)});
      }
    }
    RansEncoder encoder;
    for (const Coded& c : all) {
      ASSERT_EQ(code_next_split(encoder, model.phase(2), c.whose, c.valence, c.free, c.generation), c.generation);
    }
    const ExactBytes bytes(encoder.finish());
    RansDecoder decoder(bytes.view());
    for (const Coded& c : all) {
      ASSERT_EQ(code_next_split(decoder, model.phase(2), c.whose, c.valence, c.free, 1), c.generation);
    }
    ASSERT_TRUE(decoder.finished_cleanly());
  }
}

TEST(NextSplit, WhereNoGenerationIsFreeNothingIsCoded) {
  const SplitModel model;
  FreeGenerations none(7, 8);
  none.exclude(7);
  none.exclude(8);
  RansEncoder encoder;
  for (const NextSplitOf whose : kAll)
    EXPECT_EQ(code_next_split(encoder, model.phase(2), whose, 6, none, kNeverSplit), kNeverSplit);
  encoder.bits(15, 77);
  RansEncoder only_bits;
  only_bits.bits(15, 77);
  EXPECT_EQ(encoder.finish(), only_bits.finish());
}

TEST(NextSplit, NoTakenGenerationComesOutOfAnyBytes) {
  const SplitModel model;
  std::size_t found = 0;
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const ExactBytes bytes(noise(random, 60));
    RansDecoder decoder(bytes.view());
    for (int i = 0; i < 30; ++i) {
      const Case c(random);
      const std::uint8_t next =
          code_next_split(decoder, model.phase(2), kAll[random.below(3)], random.below(300), c.free(), kNeverSplit);
      if (next == kNeverSplit) continue;
      const std::vector<std::uint32_t> free = c.expected();
      ASSERT_NE(std::find(free.begin(), free.end(), next), free.end()) << int{next};
      ++found;
    }
  }
  EXPECT_GT(found, 10000U);
}

void expect_no_neighbours_together(const LinkedFans& fans, const std::vector<std::uint8_t>& next) {
  for (VertexId v = 0; v < next.size(); ++v) {
    fans.for_each_neighbour(v, [&](VertexId w) {
      EXPECT_TRUE(next[v] == kNeverSplit || next[v] != next[w]) << "vertices " << v << " and " << w;
    });
  }
}

TEST(NextSplit, ThoseOfABaseComeBack) {
  const SplitModel model;
  for (const auto& [name, mesh] : fan_shapes()) {
    const LinkedFans fans(mesh.positions.size(), mesh.triangles);
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      SCOPED_TRACE(name + ", seed " + std::to_string(seed));
      SeededRandom random(seed);
      const std::uint32_t last = 1 + random.below(kMostGenerations);
      std::vector<std::uint8_t> next(mesh.positions.size(), kNeverSplit);
      for (VertexId v = 0; v < next.size(); ++v) {
        const auto wanted = static_cast<std::uint8_t>(1 + random.below(last));
        bool taken = random.one_in(4);
        fans.for_each_neighbour(v, [&](VertexId w) { taken = taken || next[w] == wanted; });
        if (!taken) next[v] = wanted;
      }
      RansEncoder encoder;
      std::vector<std::uint8_t> given = next;
      code_base_splits(encoder, model, fans, last, std::span(given));
      ASSERT_EQ(given, next);
      const ExactBytes bytes(encoder.finish());
      RansDecoder decoder(bytes.view());
      std::vector<std::uint8_t> found(next.size(), 1);
      code_base_splits(decoder, model, fans, last, std::span(found));
      ASSERT_EQ(found, next);
      ASSERT_TRUE(decoder.finished_cleanly());
    }
  }
}

TEST(NextSplit, ABaseOfAnyBytesHasNoNeighboursInOneGeneration) {
  const SplitModel model;
  for (const auto& [name, mesh] : fan_shapes()) {
    const LinkedFans fans(mesh.positions.size(), mesh.triangles);
    for (std::uint64_t seed = 0; seed < 60; ++seed) {
      SCOPED_TRACE(name + ", seed " + std::to_string(seed));
      SeededRandom random(seed);
      const std::uint32_t last = 1 + random.below(kMostGenerations);
      const ExactBytes bytes(noise(random, 3 * mesh.positions.size()));
      RansDecoder decoder(bytes.view());
      std::vector<std::uint8_t> next(mesh.positions.size(), 1);
      code_base_splits(decoder, model, fans, last, std::span(next));
      for (const std::uint8_t g : next) ASSERT_TRUE(g == kNeverSplit || (g >= 1 && g <= last));
      expect_no_neighbours_together(fans, next);
      if (HasFailure()) return;
    }
  }
}

}  // namespace
}  // namespace fanstream
