#include "common/refine/generation_queue.h"

#include <gtest/gtest.h>

#include <deque>
#include <map>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

TEST(GenerationQueue, TheCoarsestComeFirstAndOfThemTheFirst) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    testing::SeededRandom random(seed);
    GenerationQueue queue;
    std::map<std::uint32_t, std::deque<std::uint32_t>> expected;
    for (std::uint32_t step = 0; step < 3000; ++step) {
      const bool grows = step / 500 % 2 == 0;
      if (expected.empty() || random.below(5) < (grows ? 4U : 1U)) {
        const auto generation = static_cast<std::uint32_t>(random.below(30));
        queue.push(step, generation);
        expected[generation].push_back(step);
      } else {
        const auto first = expected.begin();
        ASSERT_EQ(queue.generation(), first->first) << "step " << step;
        ASSERT_EQ(queue.in_line(), first->second.size()) << "step " << step;
        for (std::size_t i = 0; i < first->second.size(); ++i) ASSERT_EQ(queue.at(i), first->second[i]) << i;
        ASSERT_EQ(queue.front(), first->second.front());
        queue.pop();
        first->second.pop_front();
        if (first->second.empty()) expected.erase(first);
      }
      ASSERT_EQ(queue.empty(), expected.empty()) << "step " << step;
    }
  }
}

TEST(GenerationQueue, KeepsMemoryForOneGenerationOnly) {
  GenerationQueue queue;
  for (std::uint32_t c = 0; c < 1000; ++c) queue.push(c, 1);
  for (std::uint32_t generation = 1; generation < 50; ++generation) {
    for (std::uint32_t i = 0; i < 1000; ++i) {
      const std::uint32_t c = queue.front();
      queue.pop();
      queue.push(c, generation + 1);
    }
  }
  while (!queue.empty()) queue.pop();
  EXPECT_LE(queue.memory_bytes(), 2 * 1024 * sizeof(std::uint32_t) + 128 * 32);
}

}  // namespace
}  // namespace fanstream
