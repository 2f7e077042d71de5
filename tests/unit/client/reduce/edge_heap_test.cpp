#include "client/reduce/edge_heap.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

TEST(EdgeHeap, TheCheapestIsOnTopThroughAnyChanges) {
  constexpr std::uint32_t kEdges = 300;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    testing::SeededRandom random(seed);
    EdgeHeap heap(kEdges);
    std::map<std::uint32_t, float> expected;
    for (std::uint32_t e = 0; e < kEdges; e += 2) {
      expected[e] = static_cast<float>(random.below(50));
      heap.append(e, expected[e]);
    }
    heap.order_all();
    for (int step = 0; step < 2000; ++step) {
      const std::uint32_t edge = random.below(kEdges);
      if (random.one_in(3)) {
        heap.remove(edge, EdgeHeap::kFirstState + 2);
        expected.erase(edge);
        EXPECT_EQ(heap.state(edge), EdgeHeap::kFirstState + 2);
      } else {
        expected[edge] = static_cast<float>(random.below(50));
        heap.put(edge, expected[edge]);
      }
      ASSERT_EQ(heap.size(), expected.size());
      if (expected.empty()) continue;
      const auto least = std::min_element(expected.begin(), expected.end(), [](const auto& a, const auto& b) {
        return a.second != b.second ? a.second < b.second : a.first < b.first;
      });
      ASSERT_EQ(heap.top(), least->first) << "seed " << seed << ", step " << step;
      ASSERT_EQ(heap.top_cost(), least->second);
      float second = 1e9F;
      for (const auto& [e, cost] : expected) second = e == least->first ? second : std::min(second, cost);
      ASSERT_EQ(heap.next_cost(1e9F), second);
      ASSERT_TRUE(heap.holds(least->first));
    }
  }
}

}  // namespace
}  // namespace fanstream
