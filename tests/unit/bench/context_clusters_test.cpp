#include "tests/bench/context_clusters.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/support/seeded_random.h"

namespace fanstream::bench {
namespace {

using testing::SeededRandom;

// Contexts of `behaviours` distributions that differ much, in turn, each seen a few hundred times.
std::vector<SymbolCounts> contexts_of(SeededRandom& random, std::size_t contexts, std::uint32_t behaviours) {
  std::vector<SymbolCounts> counts(contexts);
  for (std::size_t i = 0; i < contexts; ++i) {
    const auto preferred = static_cast<std::uint32_t>(i) % behaviours;
    for (int n = 0; n < 400; ++n) ++counts[i][random.one_in(4) ? random.below(8) : preferred];
  }
  return counts;
}

TEST(ContextClusters, PutContextsTogetherThatBehaveAlike) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const auto counts = contexts_of(random, 60, 5);
    const std::vector<int> kinds(counts.size(), 0);
    const auto clusters = cluster_contexts(counts, kinds, 5);
    ASSERT_EQ(clusters.size(), counts.size());
    for (std::size_t i = 0; i < clusters.size(); ++i) EXPECT_EQ(clusters[i], i % 5) << i;
  }
}

TEST(ContextClusters, KindsStayApartHoweverFewAreAskedFor) {
  SeededRandom random(7);
  const auto counts = contexts_of(random, 30, 1);  // all alike
  std::vector<int> kinds;
  for (std::size_t i = 0; i < counts.size(); ++i) kinds.push_back(static_cast<int>(i % 3));
  const auto clusters = cluster_contexts(counts, kinds, 1);
  for (std::size_t i = 0; i < clusters.size(); ++i) EXPECT_EQ(clusters[i], i % 3) << i;
}

TEST(ContextClusters, AreAsManyAsAreAskedFor) {
  SeededRandom random(8);
  const auto counts = contexts_of(random, 50, 7);
  const auto clusters = cluster_contexts(counts, std::vector<int>(counts.size(), 4), 20);
  EXPECT_EQ(std::set<std::uint32_t>(clusters.begin(), clusters.end()).size(), 20U);
}

}  // namespace
}  // namespace fanstream::bench
